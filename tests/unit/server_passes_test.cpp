// The server's passes: which run for which viewers, that the stages of a step are the step, and what is
// printed.
#include "server/app/server_passes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "common/groom/groom_asset.h"
#include "server/app/explain.h"
#include "server/scene/scene_content.h"
#include "server/sim/solver_registry.h"
#include "tests/support/metrics_text.h"

namespace strandcast::server_passes_test {
namespace {

using gl::PassFate;
using testing::ElementsAre;
using testing::HasSubstr;

/// A scene with everything that a fact decides.
SceneDesc full_scene() {
  SceneDesc scene = built_in_scene();
  ProceduralGroomDesc groom;
  groom.strand_count = 60;
  groom.vertex_count = 6;
  scene.groom = groom;
  scene.wind.mean_mps = {3.0f, 0.0f, 1.0f};
  scene.wind.gust_intensity = 0.3f;
  scene.wind.along_share = 0.5f;
  scene.volume.friction_per_s = 20.0;
  scene.bend_limit.most_tip_deg = 60.0;
  scene.detail.simulated_share = 0.5;
  scene.head.collider = kFieldCollider;
  scene.body.capsules.resize(1);
  scene.head.field_resolution = 16;
  scene.colliders = {{glm::vec3(0.0f, -0.3f, 0.0f), 0.1f}};
  scene.look.methods = {"marschner", "dual", "vertex"};  // each has tables
  return scene;
}

SceneDesc bare_scene() {
  SceneDesc scene = full_scene();
  scene.wind = {};
  scene.volume = {};
  scene.bend_limit = {};
  scene.detail = {};
  scene.body = {};
  scene.head.collider = kSphereCollider;
  scene.colliders.clear();
  scene.has_auto_collider = false;
  scene.follicle_limit_deg = 180.0;
  return scene;
}

SceneAsset asset_of(const SceneDesc& scene) {
  const auto content = load_scene_content(scene);
  EXPECT_TRUE(content.ok());
  return content ? make_scene_asset(content->groom, content->head) : SceneAsset{};
}

std::vector<std::string> kept(const gl::PassReports& passes) {
  std::vector<std::string> names;
  for (const gl::PassReport& pass : passes)
    if (pass.fate == PassFate::Kept) names.push_back(pass.name);
  return names;
}

TEST(ServerPlan, RunsOnlyWhatTheSceneAndItsViewersNeed) {
  const SceneDesc full = full_scene();
  const auto watched = plan_server(full, asset_of(full), {.strand_viewers = 1, .frame_viewers = 1});
  ASSERT_TRUE(watched) << watched.error().to_string();
  int codecs = 0;
  for (const gl::PassReport& pass : *watched) {
    const bool is_codec = pass.name == "encode/jpeg" || pass.name == "encode/tiles" ||
                          pass.name == "encode/vp8" || pass.name == "encode/h264";
    if (is_codec && pass.fate == PassFate::Kept) ++codecs;
    EXPECT_TRUE(is_codec || pass.fate == PassFate::Kept) << pass.name;
    EXPECT_FALSE(pass.reason.empty()) << pass.name;
  }
  EXPECT_EQ(codecs, 1) << "one view has one codec";

  const SceneDesc bare = bare_scene();
  const auto unwatched = plan_server(bare, asset_of(bare), {});
  ASSERT_TRUE(unwatched) << unwatched.error().to_string();
  EXPECT_THAT(kept(*unwatched), ElementsAre("scene/motion", "sim/step", "publish/read", "publish/quantise"));
  for (const gl::PassReport& pass : *unwatched)
    EXPECT_EQ(pass.reason.find("nobody watches") != std::string::npos,
              pass.fate == PassFate::Kept && pass.name.starts_with("publish/"))
        << pass.name;
  EXPECT_GT(saved_bytes(*unwatched), 0u);
  EXPECT_LT(kept_bytes(*unwatched), kept_bytes(*watched));

  const auto strands = plan_server(bare, asset_of(bare), {.strand_viewers = 1});
  ASSERT_TRUE(strands);
  EXPECT_THAT(kept(*strands),
              ElementsAre("scene/motion", "sim/step", "publish/read", "publish/quantise", "encode/strands"));
}

/// Keeps what it is told.
class RecordingSolver final : public Solver {
 public:
  Status load(const Groom&, const glm::dquat&) override { return {}; }
  void substep(const StepInput& input) override {
    steps.push_back(input);
    if (steps.size() == stop_after) is_stopping = true;
  }
  void read(SolverState& out) override { out = state; }
  void write(const SolverState& in) override { state = in; }
  void rebase(const glm::dquat& world_from_head_rotation) override {
    jumps.push_back(world_from_head_rotation);
  }
  uint32_t strand_count() const override { return strands_in_groom; }
  uint64_t memory_bytes() const override { return 0; }

  SolverState state;
  uint32_t strands_in_groom = 0;
  std::vector<StepInput> steps;
  std::vector<glm::dquat> jumps;
  size_t stop_after = 0;
  std::atomic<bool> is_stopping{false};
};

InputFrame turned(int step) {
  InputFrame input;
  input.has_motion = true;
  input.has_teleported = step == 3;
  input.world_from_head.position_m = {0.01 * step, 0.002 * step, 0.0};
  input.world_from_head.rotation = glm::angleAxis(0.05 * step, glm::dvec3(0.0, 1.0, 0.0));
  return input;
}

struct StageWorld {
  explicit StageWorld(const SceneDesc& wanted)
      : scene(wanted),
        content(load_scene_content(scene).value()),
        builder(scene, content.colliders),
        publisher(content.groom, 1e-4f),
        stages(stage_sizes(scene, make_scene_asset(content.groom, {})), explain(scene, {})) {
    solver.strands_in_groom = content.groom.strand_count();
  }
  Status step(int step) {
    StageTurn turn(builder, solver, publisher);
    turn.input = turned(step);
    turn.end_time_s = step / scene.step_rate_hz;
    turn.is_stopping = &solver.is_stopping;
    return stages.step(turn, nullptr);
  }

  SceneDesc scene;
  SceneContent content;
  RecordingSolver solver;
  StepBuilder builder;
  Publisher publisher;
  SimStages stages;
};

TEST(SimStages, AStepRunInStagesIsTheStepThatTheFactsAskForBitForBit) {
  for (const SceneDesc& scene : {full_scene(), bare_scene()}) {
    StageWorld world(scene);
    StepBuilder other(scene, world.content.colliders);
    const SceneFeatures features = analyse(scene, {});
    std::vector<StepInput> expected;
    size_t jumps = 0;
    for (int step = 1; step <= 5; ++step) {
      ASSERT_TRUE(world.step(step));
      const SceneStep& whole = other.build(turned(step), features, step / scene.step_rate_hz);
      expected.insert(expected.end(), whole.substeps.begin(), whole.substeps.end());
      jumps += whole.carried_to_rotation ? 1 : 0;
    }
    EXPECT_EQ(jumps, 4u) << "the first pose, a teleport, and two steps after it whose speed is not known yet";
    EXPECT_EQ(world.solver.jumps.size(), jumps);
    ASSERT_EQ(world.solver.steps.size(), expected.size());
    for (size_t i = 0; i < expected.size(); ++i) {
      const StepInput& ran = world.solver.steps[i];
      EXPECT_EQ(ran.renews_volume, i % scene.substeps == 0);
      EXPECT_EQ(ran.world_from_head_rotation, expected[i].world_from_head_rotation);
      EXPECT_EQ(ran.head_shift_m, expected[i].head_shift_m);
      EXPECT_EQ(ran.wind_mps, expected[i].wind_mps);
      EXPECT_EQ(ran.wind_mps != glm::dvec3(0.0), features.has_wind);
      ASSERT_EQ(ran.gusts.size(), expected[i].gusts.size());
      EXPECT_EQ(!ran.gusts.empty(), features.has_turbulence);
      for (size_t g = 0; g < ran.gusts.size(); ++g)
        EXPECT_EQ(ran.gusts[g].phase_rad, expected[i].gusts[g].phase_rad);
      ASSERT_EQ(ran.colliders.size(), expected[i].colliders.size());
      EXPECT_EQ(!ran.colliders.empty(), features.has_colliders);
      EXPECT_EQ(ran.follicle_limit_rad < kFreeFollicleRad, features.has_follicle_limit);
      for (size_t c = 0; c < ran.colliders.size(); ++c)
        EXPECT_EQ(ran.colliders[c].center_m, expected[i].colliders[c].center_m);
    }
  }
}

TEST(SimStages, WhatTheListSaysRanAndNothingElse) {
  StageWorld world(bare_scene());
  ASSERT_TRUE(world.step(1));
  ASSERT_TRUE(world.step(2));
  for (const gl::PassReport& pass : world.stages.report()) {
    const bool has_run = pass.name == "scene/motion" || pass.name == "sim/step";
    EXPECT_EQ(pass.runs, has_run ? 2u : 0u) << pass.name;
    const bool is_off =
        (pass.name.starts_with("scene/") || pass.name == "sim/volume" || pass.name == "publish/follow") &&
        !has_run;
    EXPECT_EQ(pass.fate == PassFate::NotRequested, is_off) << pass.name;
  }
  // A wind stream connects.
  world.stages.plan_step(world.scene.substeps, explain(world.scene, {.has_wind_stream = true}));
  EXPECT_THAT(kept(world.stages.report()),
              ElementsAre("scene/motion", "scene/wind", "sim/step", "publish/read", "publish/quantise"));
}

TEST(SimStages, AStepEndsBetweenSubstepsWhenItIsToldToStop) {
  SceneDesc scene = bare_scene();
  scene.substeps = 8;
  StageWorld world(scene);
  world.solver.stop_after = 3;
  ASSERT_TRUE(world.step(1));
  EXPECT_EQ(world.solver.steps.size(), 3u);
}

// So that it is at rest seen from the head: what it is told when it is written back.
TEST(SimStages, AStrandThatIsPutBackMovesWithTheHeadOfTheNewestStep) {
  for (const uint32_t substeps : {1u, 4u}) {
    SceneDesc scene = bare_scene();
    scene.substeps = substeps;
    StageWorld world(scene);
    const size_t vertices = world.content.groom.rest_position_m.size();
    world.solver.state.position_m.assign(vertices, glm::vec3(std::numeric_limits<float>::quiet_NaN()));
    world.solver.state.velocity_mps.assign(vertices, glm::vec3(0.0f));
    ASSERT_TRUE(world.step(1));
    ASSERT_TRUE(world.step(2));  // 0.01 m to the side and 0.002 m up
    StageTurn turn(world.builder, world.solver, world.publisher);
    ASSERT_TRUE(world.stages.publish(turn));
    ASSERT_FALSE(world.publisher.quarantined().empty());
    world.publisher.repair(world.solver);
    const glm::dvec3 head_mps = glm::dvec3(0.01, 0.002, 0.0) * scene.step_rate_hz;
    ASSERT_EQ(world.solver.state.velocity_mps.size(), vertices);
    for (const glm::vec3& velocity_mps : world.solver.state.velocity_mps)
      EXPECT_LT(glm::distance(glm::dvec3(velocity_mps), head_mps), 1e-5);
  }
}

TEST(Explain, NamesEverySolverAndPrintsTheListAsItIs) {
  for (const SolverRow& row : solver_table()) EXPECT_THAT(list_solvers(), HasSubstr(row.name));
  const SceneDesc scene = bare_scene();
  const SceneAsset asset = asset_of(scene);
  auto passes = plan_server(scene, asset, {});
  ASSERT_TRUE(passes);
  (*passes)[0].runs = 1;
  (*passes)[0].median_ms = 1.25;
  const auto text =
      explain_scene(scene, asset, {}, {"an abacus", *passes}, {"half of the strands are stiffened"});
  ASSERT_TRUE(text) << text.error().to_string();
  for (const char* part : {"Simulated on: an abacus", "half of the strands are stiffened", "has_wind",
                           "has_head_mesh", "1.25 ms", "unread", "not requested", "saved"})
    EXPECT_THAT(*text, HasSubstr(part));
  // A scene that leaves its quality to the machine: by the time of a step, and why.
  SceneDesc open_scene = scene;
  open_scene.quality = kAutoQuality;
  open_scene.step_rate_hz = 60.0;
  const auto with_step = [&](double step_ms) {
    return *explain_scene(open_scene, asset, {}, {"", *passes, step_ms});
  };
  EXPECT_THAT(with_step(8.3),
              HasSubstr("Quality: auto, full here, as a step of full takes 8.3 ms of the 16.7 ms"));
  EXPECT_THAT(with_step(8.4), HasSubstr("Quality: auto, fast here"));
  size_t at = text->find("\nPasses\n");
  for (const gl::PassReport& pass : *passes) {
    const size_t next = text->find(fmt::format("\n  {:<18} {}", pass.name, gl::to_string(pass.fate)), at);
    ASSERT_NE(next, std::string::npos) << pass.name << " is not printed after the one before it";
    at = next;
  }
}

TEST(Metrics, SayThePassesAndWhatOpenGlHolds) {
  const SceneDesc scene = bare_scene();
  const auto passes = plan_server(scene, asset_of(scene), {});
  ASSERT_TRUE(passes);
  gl::ObjectCounts objects;
  objects.objects[static_cast<size_t>(gl::ObjectKind::Buffer)] = 7;
  objects.size_bytes = 4096;
  const std::string text = format_passes(*passes, objects);
  EXPECT_THAT(test::metric_faults(text), testing::IsEmpty());
  for (const char* line :
       {"strandcast_pass_is_kept{pass=\"sim/step\"} 1\n", "strandcast_pass_is_kept{pass=\"render/head\"} 0\n",
        "strandcast_gl_objects{kind=\"buffer\"} 7\n", "strandcast_gl_bytes 4096\n",
        "# TYPE strandcast_pass_median_ms gauge\n"})
    EXPECT_THAT(text, HasSubstr(line));
}

}  // namespace
}  // namespace strandcast::server_passes_test
