// Scenes as they ship, on an upright head in still air: hair stays as it was groomed.
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "common/scene/scene_file.h"
#include "common/strands/head/head_field.h"
#include "server/scene/scene_content.h"
#include "server/scene/step_builder.h"
#include "tests/support/shared_data.h"
#include "tests/support/solver_fixture.h"
#include "tests/support/some_strands.h"

namespace strandcast::groom_rest_test {
namespace {

/// A hundredth of the strand, 1 mm in 10 cm: no eye tells the two shapes apart. Colliders that reach into the
/// groom are what it is for; without them only rounding is left.
constexpr double kShareOfLength = 0.01;
constexpr int kSteps = 60;

class GroomAtRest : public SolverTest {
 protected:
  /// Largest way of a vertex from the groomed shape over the length of its strand, after one second.
  static double largest_share(const SceneDesc& scene, const SceneContent& content, Solver& solver) {
    StepBuilder builder(scene, content.colliders);
    SceneFeatures still;
    still.has_colliders = true;
    for (int step = 1; step <= kSteps; ++step) {
      for (const StepInput& substep : builder.build(InputFrame{}, still, step / scene.step_rate_hz).substeps)
        solver.substep(substep);
    }
    const SolverState state = read(solver);
    const uint32_t strand_count = content.groom.strand_count();
    double largest = 0.0;
    for (uint32_t s = 0; s < strand_count; ++s) {
      const glm::vec3* rest = content.groom.rest_position_m.data() + content.groom.offset[s];
      double length_m = 0.0;
      double way_m = 0.0;
      for (uint32_t i = 1; i < content.groom.vertex_count(s); ++i) {
        length_m += glm::distance(rest[i], rest[i - 1]);
        way_m = std::fmax(way_m, glm::distance(state.position_m[i * strand_count + s], rest[i]));
      }
      if (length_m > 1e-3) largest = std::fmax(largest, way_m / length_m);
    }
    return largest;
  }

  void expect_rest(const SceneDesc& scene, const std::vector<SolverKind>& kinds) {
    const auto content = load_scene_content(scene);
    ASSERT_TRUE(content) << content.error().to_string();
    for (const SolverKind& kind : kinds) {
      if (!kind.host.is_kernel() || kind.row->name.rfind("dftl", 0) != 0)
        continue;  // parity covers the references
      SCOPED_TRACE(kind.name());
      auto solver = make(kind, content->groom, scene.solver.parameters);
      EXPECT_LE(largest_share(scene, *content, *solver), kShareOfLength);
    }
  }

  void expect_rest_of(const std::string& scene_name, const std::string& groom_file) {
    const std::filesystem::path groom = std::filesystem::path(STRANDCAST_SHARED_DATA) / "grooms" / groom_file;
    REQUIRE_SHARED(groom);
    const auto path =
        std::filesystem::path(STRANDCAST_SOURCE_DIR) / "deploy/scenes" / (scene_name + ".textproto");
    const auto scene = load_scene(path, {"groom.file.path=" + groom.string()});
    ASSERT_TRUE(scene) << scene.error().to_string();
    expect_rest(*scene, kinds_of_long_tests());
  }
};

TEST_F(GroomAtRest, BuiltInHair) {
  SceneDesc scene = built_in_scene();
  scene.solver.parameters.clear();  // the rows' defaults: the groomed shape carries all of the weight
  expect_rest(scene, all_kinds());
}

// Whoever lets the groomed shape carry the weight keeps it, not for a second only.
TEST_F(GroomAtRest, EveryModelKeepsItsStyleForTwentySeconds) {
  constexpr double kMostM = 2e-3;
  constexpr double kRestS = 20.0;
  constexpr uint32_t kStrands = 64;
  const SceneDesc scene = built_in_scene();
  const auto content = load_scene_content(scene);
  ASSERT_TRUE(content) << content.error().to_string();
  const Groom groom = test::some_strands(content->groom, kStrands);
  int models = 0;
  for (const SolverKind& kind : kinds_of_long_tests()) {
    const auto& known = kind.row->parameters;
    const bool has_style =
        std::ranges::any_of(known, [](const auto& info) { return info.name == "sag_free"; });
    if (!kind.host.is_kernel() || !has_style) continue;
    ++models;
    SCOPED_TRACE(kind.name());
    auto solver = make(kind, groom, {{"sag_free", 1.0}});
    StepBuilder builder(scene, content->colliders);
    SceneFeatures still;
    still.has_colliders = true;
    const int steps = static_cast<int>(kRestS * scene.step_rate_hz);
    for (int step = 1; step <= steps; ++step)
      for (const StepInput& substep : builder.build(InputFrame{}, still, step / scene.step_rate_hz).substeps)
        solver->substep(substep);
    const SolverState state = read(*solver);
    double sum_m2 = 0.0;
    for (uint32_t s = 0; s < kStrands; ++s)
      for (uint32_t i = 0; i < groom.vertex_count(s); ++i) {
        const glm::vec3 off_m =
            state.position_m[i * kStrands + s] - groom.rest_position_m[groom.offset[s] + i];
        sum_m2 += glm::dot(off_m, off_m);
      }
    const double rms_m = std::sqrt(sum_m2 / static_cast<double>(groom.rest_position_m.size()));
    EXPECT_LE(rms_m, kMostM);
    RecordProperty(kind.row->name, fmt::format("{:.2e}", rms_m));
  }
  EXPECT_GE(models, 8);
}

// Rods find the shape that is the groom under gravity themselves.
TEST_F(GroomAtRest, ElasticRods) {
  const auto path = std::filesystem::path(STRANDCAST_SOURCE_DIR) / "deploy/scenes/elastic_rod.textproto";
  const auto scene = load_scene(path, {});
  ASSERT_TRUE(scene) << scene.error().to_string();
  const auto content = load_scene_content(*scene);
  ASSERT_TRUE(content) << content.error().to_string();
  SceneContent some = *content;
  some.groom = test::some_strands(content->groom, static_cast<uint32_t>(on_grid(300, 1'000'000)));
  for (const SolverHost& host : kernel_hosts()) {
    auto solver = make({*find_solver("direct_rod"), host}, some.groom, scene->solver.parameters);
    EXPECT_LE(largest_share(*scene, some, *solver), kShareOfLength) << host.name();
  }
}

TEST_F(GroomAtRest, SintelsHair) {
  expect_rest_of("sintel", "sintel_11400x16.tfx");
}

TEST_F(GroomAtRest, TheMohawk) {
  expect_rest_of("mohawk", "Ratboy_mohawk.tfx");
}

/// Strands that stand out level from the sides of the head, on which they fall.
Groom level_hair() {
  constexpr uint32_t kStrands = 48, kVertices = 24;
  constexpr float kLengthM = 0.34f, kRadiusM = 0.096f;
  std::vector<std::vector<glm::vec3>> strands;
  for (uint32_t s = 0; s < kStrands; ++s) {
    const float side = s % 2 == 0 ? 1.0f : -1.0f;
    const float angle = 0.5f * static_cast<float>(s / 2) / (0.5f * kStrands) - 0.1f;  // behind the ear
    const glm::vec3 out(side * std::cos(angle), 0.0f, -std::sin(angle));
    std::vector<glm::vec3> strand;
    for (uint32_t i = 0; i < kVertices; ++i)
      strand.push_back(out * (kRadiusM + kLengthM * static_cast<float>(i) / (kVertices - 1)));
    strands.push_back(strand);
  }
  return groom_from(strands, Pinning::RootPair);
}

/// How deep the deepest vertex lies in the built-in neck and shoulders, m.
double deepest_in_bust_m(const SolverState& state, const glm::dquat& world_from_head) {
  constexpr float kRadiusM = 0.095f;
  double deepest_m = 0.0;
  for (const glm::vec3& point : state.position_m) {
    const glm::vec3 in_head(glm::conjugate(world_from_head) * glm::dvec3(point));
    deepest_m = std::fmax(deepest_m, static_cast<double>(-kRadiusM * bust_distance(in_head / kRadiusM)));
  }
  return deepest_m;
}

// Hair longer than the way to the shoulders lies on them when it has fallen, and does not hang through them;
// nor do they cut into it while the head turns by 60 degrees in half a second, and nods.
TEST_F(GroomAtRest, LongHairFallsOntoTheShoulders) {
  SceneDesc scene = built_in_scene();
  const SceneContent content = load_scene_content(scene).value();
  const auto deepest_m = [&](const SolverHost& host, const std::vector<SphereCollider>& colliders) {
    const Groom groom = level_hair();
    const SolverParameters limp = {
        {"style_stiffness_per_s2", 0.0}, {"sag_free", 0.0}, {"air_drag_per_s", 4.0}};
    auto solver = make({*find_solver("dftl"), host}, groom, limp);
    StepBuilder builder(scene, colliders);
    SceneFeatures still;
    still.has_colliders = true;
    for (int step = 1; step <= 4 * kSteps; ++step)
      for (const StepInput& substep : builder.build(InputFrame{}, still, step / scene.step_rate_hz).substeps)
        solver->substep(substep);
    double lowest_m = 0.0;
    for (const glm::vec3& point : read(*solver).position_m)
      lowest_m = std::fmin(lowest_m, static_cast<double>(point.y));
    EXPECT_LT(lowest_m, -0.2) << "it fell";
    double deepest = deepest_in_bust_m(read(*solver), glm::dquat(1, 0, 0, 0));
    InputFrame turn;
    turn.has_motion = true;
    for (int step = 1; step <= kSteps; ++step) {
      const double turned_rad = 1.05 * std::fmin(step / 30.0, 1.0), nodded_rad = 0.2 * std::sin(0.1 * step);
      turn.world_from_head.rotation =
          glm::angleAxis(turned_rad, glm::dvec3(0, 1, 0)) * glm::angleAxis(nodded_rad, glm::dvec3(1, 0, 0));
      const double end_s = (4 * kSteps + step) / scene.step_rate_hz;
      for (const StepInput& substep : builder.build(turn, still, end_s).substeps) solver->substep(substep);
      deepest = std::fmax(deepest, deepest_in_bust_m(read(*solver), turn.world_from_head.rotation));
    }
    return deepest;
  };
  for (const SolverHost& host : kernel_hosts())
    EXPECT_LT(deepest_m(host, content.colliders), 0.02) << host.name();
  // As it was: the skull and the neck alone.
  std::vector<SphereCollider> head;
  for (const SphereCollider& sphere : content.colliders)
    if (std::abs(sphere.center_m.x) < 0.02f && sphere.center_m.y > -0.2f) head.push_back(sphere);
  EXPECT_GT(deepest_m(kLanesHost, head), 0.03);
}

}  // namespace
}  // namespace strandcast::groom_rest_test
