// What a running server holds and runs for what nobody asked: no buffer, program, context or thread of it.
// And that what it says it runs is what --explain plans.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "common/gl/egl_context.h"
#include "common/gl/objects.h"
#include "common/groom/groom_asset.h"
#include "server/app/explain.h"
#include "server/app/server_passes.h"
#include "tests/support/server_fixture.h"
#include "tests/support/udp_socket.h"

namespace strandcast::server_cost_test {
namespace {

using gl::ObjectCounts;
using gl::ObjectKind;

/// Numbers and names of this process's threads. A driver's have names of their own, most of them, from when
/// they first run.
std::map<std::string, std::string> all_threads() {
  std::map<std::string, std::string> names;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task"))
    std::getline(std::ifstream(task.path() / "comm"), names[task.path().filename().string()]);
  return names;
}

/// Names and fates: what a list says that does not depend on the machine.
std::vector<std::pair<std::string, gl::PassFate>> decisions(const gl::PassReports& passes) {
  std::vector<std::pair<std::string, gl::PassFate>> decided;
  for (const gl::PassReport& pass : passes) decided.emplace_back(pass.name, pass.fate);
  return decided;
}

/// No wind, nothing to collide with, no head, free roots.
SceneDesc barest_scene() {
  SceneDesc scene = test::bald_scene();
  scene.wind = {};
  scene.has_auto_collider = false;
  scene.follicle_limit_deg = 180.0;
  scene.stream.codec = "tangent";  // a server that steps has a second codec, for who cannot
  scene.stream.has_codec = true;
  return scene;
}

class ServerCost : public test::ServerFixture {
 protected:
  void SetUp() override {
    // The driver's threads come with the first context and serve all.
    auto context = gl::EglContext::make("auto");
    if (!context) GTEST_SKIP() << "needs OpenGL 4.5: " << context.error().to_string();
    driver_ = std::move(*context);
    driver_->release();
    before_ = gl::object_counts();
    threads_before_ = all_threads();
  }
  uint64_t added(ObjectKind kind) const { return gl::object_counts().of(kind) - before_.of(kind); }
  /// Names of threads that were not there before, sorted, without the driver's and the shared workers.
  std::vector<std::string> added_threads() const {
    const std::set<std::string> own = {"simulation", "network", "status", "frames", "encode", "mocap"};
    std::vector<std::string> names;
    for (const auto& [number, name] : all_threads())
      if (!threads_before_.contains(number) && own.contains(name)) names.push_back(name);
    std::sort(names.begin(), names.end());
    return names;
  }
  uint64_t compiled() const { return gl::object_counts().compiled_programs - before_.compiled_programs; }
  uint64_t added_bytes() const { return gl::object_counts().size_bytes - before_.size_bytes; }

  gl::PassReports planned(const SceneDesc& scene, const RuntimeFacts& facts) const {
    const auto content = load_scene_content(scene);
    EXPECT_TRUE(content.ok());
    const auto passes = plan_server(scene, make_scene_asset(content->groom, content->head), facts);
    EXPECT_TRUE(passes.ok());
    return *passes;
  }

  std::unique_ptr<gl::EglContext> driver_;
  ObjectCounts before_;
  std::map<std::string, std::string> threads_before_;
};

/// Simulated by OpenGL wherever the test runs.
ServerConfig on_gl(const SceneDesc& scene) {
  ServerConfig config;
  config.scene = scene;
  config.sim_device = "gl";
  return config;
}

TEST_F(ServerCost, WhatTheProcessorSimulatesTakesNothingOfOpenGl) {
  ServerConfig config = on_gl(barest_scene());
  config.sim_device = "lanes";
  ASSERT_TRUE(start(std::move(config)));
  EXPECT_EQ(gl::object_counts(), before_);
  EXPECT_GT(server_->counters().sim.solver_bytes, 0u);
  EXPECT_EQ(decisions(server_->passes()), decisions(planned(barest_scene(), {})));
}

TEST_F(ServerCost, ASceneThatNeedsNothingHasItsStrandsAndNothingElse) {
  ASSERT_TRUE(start(on_gl(barest_scene())));
  const ObjectCounts now = gl::object_counts();
  EXPECT_EQ(now.contexts - before_.contexts, 1u) << "the simulation's; the frame thread has none";
  EXPECT_EQ(compiled(), 1u) << "one kernel, no variant for colliders or gusts";
  EXPECT_EQ(added(ObjectKind::Program), 1u);
  EXPECT_EQ(added(ObjectKind::Framebuffer), 0u);
  EXPECT_EQ(added(ObjectKind::VertexArray), 0u);
  EXPECT_EQ(added_bytes(), server_->counters().sim.solver_bytes) << "buffers that no solver knows of";
  EXPECT_EQ(decisions(server_->passes()), decisions(planned(barest_scene(), {})));
  // The frame thread sleeps; there is no encoder.
  const std::vector<std::string> needed = {"frames", "network", "simulation", "status"};
  EXPECT_TRUE(eventually([&] { return added_threads() == needed; }))
      << testing::PrintToString(added_threads());
}

TEST_F(ServerCost, LiveInputsTakeOneThreadForAllWhereTheyAreAskedFor) {
  SceneDesc scene = barest_scene();
  for (int i = 0; i < 2; ++i) scene.live.push_back({.protocol = "vmc", .port = test::free_udp_port()});
  ASSERT_TRUE(start(on_gl(scene)));
  const std::vector<std::string> needed = {"frames", "mocap", "network", "simulation", "status"};
  EXPECT_TRUE(eventually([&] { return added_threads() == needed; }))
      << testing::PrintToString(added_threads());
  EXPECT_EQ(decisions(server_->passes()), decisions(planned(barest_scene(), {})));
}

TEST_F(ServerCost, EachFactOfTheSceneCostsItsOwnVariants) {
  ASSERT_TRUE(start(on_gl(barest_scene())));
  server_->stop();
  server_.reset();
  const uint64_t bare = compiled();
  SceneDesc scene = barest_scene();
  scene.has_auto_collider = true;
  ASSERT_TRUE(start(on_gl(scene)));
  EXPECT_GT(compiled() - bare, bare) << "colliders need programs that the bare scene has not";
  EXPECT_EQ(decisions(server_->passes()), decisions(planned(scene, {})));
  server_->stop();
  server_.reset();
  const uint64_t before = compiled();
  scene = barest_scene();
  scene.follicle_limit_deg = SceneDesc().follicle_limit_deg;
  ASSERT_TRUE(start(on_gl(scene)));
  EXPECT_EQ(compiled() - before, bare + 1) << "held roots take one program more";
  server_->stop();
  server_.reset();
  const uint64_t before_field = compiled();
  scene = barest_scene();
  scene.has_auto_collider = true;
  scene.head.collider = kFieldCollider;
  scene.head.field_resolution = 16;
  ASSERT_TRUE(start(on_gl(scene)));
  EXPECT_EQ(compiled() - before_field, bare + 1) << "a head that is a field takes one more, without spheres";
  EXPECT_EQ(decisions(server_->passes()), decisions(planned(scene, {})));
  server_->stop();
  server_.reset();
  const uint64_t before_body = compiled();
  scene = barest_scene();
  scene.body.preset = kUpperBody;
  ASSERT_TRUE(start(on_gl(scene)));
  EXPECT_EQ(compiled() - before_body, bare + 1) << "so does a body";
  EXPECT_EQ(decisions(server_->passes()), decisions(planned(scene, {})));
}

TEST_F(ServerCost, WhatViewersNeedComesAndGoesWithThem) {
  const SceneDesc scene = barest_scene();
  ASSERT_TRUE(start(scene));
  const ObjectCounts unwatched = gl::object_counts();
  {
    const auto viewer = open(client_config(StreamMode::Strands));
    ASSERT_TRUE(viewer);
    ASSERT_TRUE(pump_until({viewer.get()}, [&] { return viewer->has_picture(); }));
    EXPECT_EQ(gl::object_counts(), unwatched) << "strands cost no OpenGL";
    const RuntimeFacts facts{.strand_viewers = 1};
    EXPECT_TRUE(eventually([&] { return decisions(server_->passes()) == decisions(planned(scene, facts)); }));
  }
  {
    ClientConfig config = client_config(StreamMode::Frames);
    config.hello.picture_codecs = decodable_picture_codecs();
    const auto viewer = open(config);
    ASSERT_TRUE(viewer);
    ASSERT_TRUE(pump_until({viewer.get()}, [&] { return viewer->has_picture(); }));
    EXPECT_EQ(gl::object_counts(), unwatched) << "nor do pictures that the processor draws";
    EXPECT_EQ(decisions(server_->passes()), decisions(planned(scene, {.frame_viewers = 1})));
    for (const gl::PassReport& pass : server_->passes())
      EXPECT_TRUE(!pass.name.starts_with("render/") || (pass.runs > 0) == (pass.fate == gl::PassFate::Kept))
          << pass.name;
  }
  EXPECT_TRUE(eventually([&] { return decisions(server_->passes()) == decisions(planned(scene, {})); }));
}

TEST_F(ServerCost, PicturesByOpenGlTakeAContextWhileTheyAreWatched) {
  ServerConfig server;
  server.scene = barest_scene();
  server.renderer = "gl";
  ASSERT_TRUE(start(std::move(server)));
  const ObjectCounts unwatched = gl::object_counts();
  {
    ClientConfig config = client_config(StreamMode::Frames);
    config.hello.picture_codecs = decodable_picture_codecs();
    const auto viewer = open(config);
    ASSERT_TRUE(viewer);
    ASSERT_TRUE(pump_until({viewer.get()}, [&] { return viewer->has_picture(); }));
    EXPECT_EQ(gl::object_counts().contexts, unwatched.contexts + 1);
    EXPECT_GT(gl::object_counts().of(ObjectKind::Program), unwatched.of(ObjectKind::Program));
    // Who only looks away finds it as it was.
    ASSERT_TRUE(viewer->client().send(WindowChange{0, 0, true}));
    ASSERT_TRUE(pump_until({viewer.get()}, [&] { return server_->counters().frame_viewers == 0; }));
    EXPECT_EQ(gl::object_counts().contexts, unwatched.contexts + 1);
  }
  ASSERT_TRUE(eventually([&] { return gl::object_counts().contexts == unwatched.contexts; }));
  ObjectCounts after = gl::object_counts();
  after.compiled_programs = unwatched.compiled_programs;  // counts on
  EXPECT_EQ(after, unwatched);
}

TEST_F(ServerCost, StrandsOfASolverOnTheProcessorAreNotOnTheGpuToo) {
  ASSERT_TRUE(start(on_gl(barest_scene())));
  ASSERT_GT(added_bytes(), 0u);
  ASSERT_EQ(run_command(ctl_target(), SetParameter{"solver.name=super_helix"}), kDoneExit);
  EXPECT_EQ(added_bytes(), 0u);
  ASSERT_EQ(run_command(ctl_target(), SetParameter{"solver.name=dftl"}), kDoneExit);
  EXPECT_EQ(added_bytes(), server_->counters().sim.solver_bytes);
}

TEST_F(ServerCost, WhatExplainMeasuresIsWhatItPlansAndAServerRuns) {
  const SceneDesc scene = test::small_scene();
  const auto content = load_scene_content(scene);
  ASSERT_TRUE(content.ok());
  const RuntimeFacts facts{.strand_viewers = 1, .frame_viewers = 1};
  const auto measured = measure_passes(scene, *content, facts, {});
  ASSERT_TRUE(measured) << measured.error().to_string();
  EXPECT_EQ(decisions(measured->passes), decisions(planned(scene, facts)));
  for (const gl::PassReport& pass : measured->passes)
    EXPECT_EQ(pass.runs > 0, pass.fate == gl::PassFate::Kept) << pass.name;
}

}  // namespace
}  // namespace strandcast::server_cost_test
