// What simulates: the rule, and what every executor does with planes and programs.
#include "server/sim/executor/executor.h"

#include "common/gl/egl_context.h"
#include "common/scene/scene_desc.h"
#include "server/sim/executor/gl_executor.h"
#include "shaders/shared/limits.h"
#include "tests/support/sim_devices.h"

namespace strandcast {
namespace {

using testing::HasSubstr;

StrandLayout layout_of(uint32_t strand_count, uint32_t vertex_count) {
  StrandLayout layout;
  layout.strand_count = strand_count;
  layout.vertex_count = vertex_count;
  return layout;
}

TEST(Executors, WhatIsAskedForByNameIsThereOrAnError) {
  for (const char* name : {"auto", "gl", "lanes"}) EXPECT_TRUE(is_sim_device_name(name));
  EXPECT_FALSE(is_sim_device_name("abacus"));
  const auto unknown = open_executor({"abacus", "auto", {}});
  ASSERT_FALSE(unknown);
  EXPECT_THAT(unknown.error().message, HasSubstr("known: auto, gl, lanes"));
  EXPECT_FALSE(open_executor({"gl", "99", {}}));
  EXPECT_FALSE(open_executor({"auto", "99", {}})) << "who names an OpenGL device wants that one";
}

TEST(Executors, OpenGlIsTakenWhereItIsAskedFor) {
  for (const ExecutorConfig& config : {ExecutorConfig{"gl", "auto", {}}, ExecutorConfig{"gl", "software", {}},
                                       ExecutorConfig{"auto", "software", {}}}) {
    const auto executor = open_executor(config);
    ASSERT_TRUE(executor) << executor.error().to_string();
    const ExecutorInfo& info = (*executor)->info();
    EXPECT_EQ(info.device, SimDevice::Gl);
    EXPECT_THAT(info.name, testing::StartsWith("OpenGL, "));
    EXPECT_NE((*executor)->timer(), nullptr);
    const auto device = gl::read_device_info();
    ASSERT_TRUE(device) << "its context is current";
    EXPECT_EQ(info.is_software, device->is_software);
    EXPECT_THAT(info.name, HasSubstr(device->renderer));
  }
}

TEST(Executors, BecomeCurrentAgain) {
  const auto first = make_gl_executor("auto");
  ASSERT_TRUE(first);
  auto plane = (*first)->make_plane("plane", 2, std::vector<glm::vec4>(2, glm::vec4(7.0f)));
  {
    const auto second = make_gl_executor("auto");
    ASSERT_TRUE(second);
  }
  ASSERT_TRUE((*first)->make_current());
  std::vector<glm::vec4> values;
  plane->read(values);
  EXPECT_EQ(values, std::vector<glm::vec4>(2, glm::vec4(7.0f)));
}

class EveryExecutor : public testing::TestWithParam<SimDevice> {
 protected:
  SimExecutors executors_;
  Executor& executor_ = executors_.on(GetParam());
};

std::vector<glm::vec4> numbered(size_t count) {
  std::vector<glm::vec4> values;
  for (size_t i = 0; i < count; ++i)
    values.emplace_back(static_cast<float>(i), -1.0f, 0.5f * static_cast<float>(i),
                        100.0f + static_cast<float>(i));
  return values;
}

TEST_P(EveryExecutor, SaysWhatItIs) {
  EXPECT_EQ(executor_.info().device, GetParam());
  EXPECT_FALSE(executor_.info().name.empty());
}

TEST_P(EveryExecutor, PlanesHoldWhatIsWrittenWhateverTheirSize) {
  for (const uint32_t strand_count : {1u, 15u, 16u, 17u, 70u}) {
    for (const uint32_t row_count : {1u, 4u, 5u}) {
      const size_t count = size_t{strand_count} * row_count;
      const auto plane = executor_.make_plane("plane", strand_count, numbered(count));
      EXPECT_GE(plane->size_bytes(), count * sizeof(glm::vec4));
      std::vector<glm::vec4> values;
      plane->read(values);
      EXPECT_EQ(values, numbered(count)) << strand_count << " x " << row_count;
      std::reverse(values.begin(), values.end());
      const std::vector<glm::vec4> written = values;
      plane->write(written);
      plane->read(values);
      EXPECT_EQ(values, written);
      const auto view = plane->view();
      if (!view) continue;
      ASSERT_EQ(view->strand_count, strand_count);
      ASSERT_EQ(view->row_count, row_count);
      for (size_t i = 0; i < count; ++i) {
        const auto row = static_cast<uint32_t>(i / strand_count);
        const auto strand = static_cast<uint32_t>(i % strand_count);
        for (uint32_t axis = 0; axis < 4; ++axis)
          EXPECT_EQ(view->row(strand / kBlockStrands, row, axis)[strand % kBlockStrands],
                    written[i][static_cast<int>(axis)]);
      }
    }
  }
}

TEST_P(EveryExecutor, PlanesTurnAboutTheOriginAndKeepW) {
  const auto plane = executor_.make_plane("plane", 3, numbered(6));
  const glm::dquat quarter = glm::angleAxis(std::acos(0.0), glm::dvec3(0.0, 1.0, 0.0));
  turn_plane(*plane, quarter);
  std::vector<glm::vec4> values;
  plane->read(values);
  for (size_t i = 0; i < values.size(); ++i) {
    const glm::vec4 before = numbered(6)[i];  // x goes to -z, z to x
    EXPECT_LE(glm::distance(values[i], glm::vec4(before.z, before.y, -before.x, before.w)), 1e-6f) << i;
  }
}

TEST_P(EveryExecutor, RefusesWhatDoesNotCompile) {
  KernelDesc desc;
  desc.shader_path = "sim/no_such_kernel.comp";
  const auto program = executor_.make_program(desc, {}, layout_of(4, 4));
  ASSERT_FALSE(program);
  EXPECT_THAT(program.error().to_string(), HasSubstr("no_such_kernel"));
}

TEST_P(EveryExecutor, TimesWhatRuns) {
  bool has_run = false;
  EXPECT_GE(timed_ms(executor_, [&] { has_run = true; }), 0.0);
  EXPECT_TRUE(has_run);
}

INSTANTIATE_TEST_SUITE_P(Of, EveryExecutor, testing::ValuesIn(sim_devices()), name_of_device);

}  // namespace
}  // namespace strandcast
