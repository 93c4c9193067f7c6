// What simulates: the rule, and what every executor does with planes and programs.
#include "server/sim/executor/executor.h"

#include <filesystem>

#include "common/base/file.h"
#include "common/gl/egl_context.h"
#include "common/kernels/lane_program.h"
#include "common/scene/scene_desc.h"
#include "look_up_probes.h"
#include "server/sim/executor/gl_executor.h"
#include "shaders/shared/limits.h"
#include "tests/support/sim_devices.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::executor_test {
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

TEST_P(EveryExecutor, TablesHoldWhatIsWritten) {
  for (const uint32_t count : {1u, 5u, 4096u}) {
    auto table = executor_.make_table("table", count);
    ASSERT_TRUE(table) << table.error().to_string();
    EXPECT_GE((*table)->size_bytes(), count * sizeof(glm::vec4));
    const std::span<glm::vec4> memory = (*table)->memory();
    if (GetParam() == SimDevice::Gl) {
      EXPECT_TRUE(memory.empty());
      continue;
    }
    ASSERT_EQ(memory.size(), count);
    EXPECT_EQ(memory.back(), glm::vec4(0.0f));
    (*table)->write(numbered(count));
    EXPECT_EQ(std::vector<glm::vec4>(memory.begin(), memory.end()), numbered(count));
  }
}

/// What tests/gl/look_up_probe.comp is asked for: elements that neighbouring strands do not have in common.
struct LookUps {
  static constexpr uint32_t kStrands = 37, kVertices = 3, kField = 1000, kVolume = 77;
  std::vector<glm::vec4> field = numbered(kField);
  std::vector<glm::vec4> volume = std::vector<glm::vec4>(kVolume);
  std::vector<glm::vec4> asked, expected;

  LookUps() {
    for (uint32_t i = 0; i < kVolume; ++i) volume[i] = glm::vec4(glm::uvec4(i * i, 7 * i, 3, i));
    for (uint32_t i = 0; i < kStrands * kVertices; ++i) {
      const uint32_t index = i * 619 % kField;
      const uint32_t other = std::min(index + 3, i * 31 % kVolume);
      asked.emplace_back(static_cast<float>(index) + 0.75f, static_cast<float>(i * 31 % kVolume), 0.0f, 0.0f);
      expected.push_back(field[index] - volume[other]);
    }
  }
  static StepBlock step() {
    StepBlock block{};
    block.shape = {kStrands, kVertices, 1, kVertices};
    return block;
  }
};

TEST(LookUp, IsTheSameForEveryInstructionSet) {
  const LookUps look_ups;
  const auto executor = open_executor({"lanes", "auto", {}});
  ASSERT_TRUE(executor);
  auto field = (*executor)->make_table("field", LookUps::kField).value();
  auto volume = (*executor)->make_table("volume", LookUps::kVolume).value();
  field->write(look_ups.field);
  std::copy(look_ups.volume.begin(), look_ups.volume.end(), volume->memory().begin());
  LaneTables tables{};
  tables[static_cast<size_t>(TableRole::Field)] = {&field->memory()[0].x, LookUps::kField};
  tables[static_cast<size_t>(TableRole::Volume)] = {&volume->memory()[0].x, LookUps::kVolume};
  size_t run_count = 0;
  for (const LaneKernel* const* probe = kLookUpProbes; *probe != nullptr; ++probe) {
    const auto sets = lane_sets();
    const auto set = static_cast<simd::InstructionSet>((*probe)->set);
    if (std::find(sets.begin(), sets.end(), set) == sets.end()) continue;
    StrandBlocks position(LookUps::kStrands, LookUps::kVertices);
    pack_blocks(look_ups.asked, position);
    StrandBlocks expected(LookUps::kStrands, LookUps::kVertices);
    pack_blocks(look_ups.expected, expected);
    LaneProgram program(**probe, {},
                        {LookUps::kStrands, LookUps::kVertices, false, false, &shared_workers()});
    LanePlanes planes{};
    planes[static_cast<size_t>(PlaneRole::Position)] = &position;
    program.run(LookUps::step(), 0, planes, tables);
    EXPECT_TRUE(std::equal(position.data(), position.data() + position.size(), expected.data()))
        << simd::to_string(set) << ", " << (*probe)->strands << " strands";
    ++run_count;
  }
  EXPECT_GE(run_count, 2u);
}

TEST(LookUp, BeyondTheEndIsTheLastElement) {
  LookUps look_ups;
  for (glm::vec4& asked : look_ups.asked) asked.x = 2e9f;
  const LaneTable field{&look_ups.field[0].x, LookUps::kField};
  const LaneTable volume{&look_ups.volume[0].x, LookUps::kVolume};
  StrandBlocks position(LookUps::kStrands, LookUps::kVertices);
  pack_blocks(look_ups.asked, position);
  LaneProgram program(*kLookUpProbes[0], {},
                      {LookUps::kStrands, LookUps::kVertices, false, false, &shared_workers()});
  LanePlanes planes{};
  planes[static_cast<size_t>(PlaneRole::Position)] = &position;
  program.run(LookUps::step(), 0, planes, {field, volume});
  EXPECT_EQ(position.row(0, 0, 0)[1], static_cast<float>(LookUps::kField - 1) - 961.0f);
}

TEST(LookUp, IsTheSameOnOpenGl) {
  const LookUps look_ups;
  const TemporaryFolder folder;
  const std::filesystem::path source(STRANDCAST_SOURCE_DIR);
  std::filesystem::copy(source / "shaders", folder.path() / "shaders",
                        std::filesystem::copy_options::recursive);
  std::filesystem::copy(source / "tests/gl/look_up_probe.comp", folder.path() / "shaders/sim");
  const auto executor = open_executor({"gl", "auto", folder.path() / "shaders"});
  ASSERT_TRUE(executor) << executor.error().to_string();
  KernelDesc desc;
  desc.shader_path = "sim/look_up_probe.comp";
  desc.meets_air = desc.meets_colliders = false;
  const auto program = (*executor)->make_program(desc, {}, layout_of(LookUps::kStrands, LookUps::kVertices));
  ASSERT_TRUE(program) << program.error().to_string();
  auto field = (*executor)->make_table("field", LookUps::kField).value();
  auto volume = (*executor)->make_table("volume", LookUps::kVolume).value();
  field->write(look_ups.field);
  volume->write(look_ups.volume);
  const auto position = (*executor)->make_plane("position", LookUps::kStrands, look_ups.asked);
  BoundPlanes planes{};
  plane_of(planes, PlaneRole::Position) = position.get();
  BoundTables tables{};
  table_of(tables, TableRole::Field) = field.get();
  table_of(tables, TableRole::Volume) = volume.get();
  (*program)->run(LookUps::step(), 0, planes, tables);
  std::vector<glm::vec4> found;
  position->read(found);
  EXPECT_EQ(found, look_ups.expected);
}

TEST(LookUp, TablesThatADeviceCannotLookUpAreRefused) {
  const auto executor = open_executor({"gl", "auto", {}});
  ASSERT_TRUE(executor);
  const uint64_t most = gl::read_device_info()->limits.of(gl::DeviceLimit::BufferTexels);
  if (most >= UINT32_MAX) GTEST_SKIP() << "this device looks up anything";
  const auto table = (*executor)->make_table("the volume", static_cast<uint32_t>(most) + 1);
  ASSERT_FALSE(table);
  EXPECT_EQ(table.error().code, ErrorCode::LimitExceeded);
  EXPECT_THAT(table.error().message, HasSubstr("the volume needs"));
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
}  // namespace strandcast::executor_test
