// How deep hair comes into the face in a dance, with the head as a field: at vertices, and between them.
// Depth is below the skin, or below where the groom itself has the same place.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/scene/scene_file.h"
#include "server/sim/followed_solver.h"
#include "server/sim/reference_field.h"
#include "tests/support/shared_data.h"
#include "tests/support/stepped_hair.h"

namespace strandcast::fringe_test {
namespace {

constexpr uint32_t kMostStrands = 500;  // of a file: the first ones cover the head evenly
constexpr double kSeconds = 3.0;
constexpr int kPlacesPerSegment = 8;

/// Turns, nods and leans of a dance, with a start that is eased in.
Pose dancing_head(double t_s) {
  const double share = std::min(1.0, t_s / 0.5), turn = 2.0 * std::numbers::pi * 0.8 * t_s;
  const auto about = [&](double deg, const glm::dvec3& axis) {
    return glm::angleAxis(share * glm::radians(deg), axis);
  };
  Pose pose;
  pose.position_m = {0.0, 1.6 + 0.04 * share * std::sin(2.0 * turn), 0.0};
  pose.rotation = about(45.0 * std::sin(turn), {0.0, 1.0, 0.0}) *
                  about(18.0 * std::sin(turn + 1.0), {0.0, 0.0, 1.0}) *
                  about(15.0 * std::sin(2.0 * turn), {1.0, 0.0, 0.0});
  return pose;
}

struct Depths {
  double vertex_m = 0.0, between_m = 0.0;  // the deepest
};

/// Brow, eyes, nose and cheeks: in front of the head joint and above the chin, at rest.
bool is_in_face(const glm::dvec3& rest_m) {
  return rest_m.z > 0.02 && rest_m.y > -0.12;
}

Depths deepest(const DistanceField& field, const SteppedHair& hair, const SteppedState& state) {
  const BustInput& bust = hair.builder().step().substeps.back().bust;
  const auto depth_m = [&](const glm::dvec3& place, const glm::dvec3& groomed) {
    if (!is_in_face(without_bust(bust.rig, bust.turn, place))) return 0.0;
    const double now_m = sample_on_bust(field, bust, place).distance_m;
    return now_m < 0.0 ? std::min(0.0, field.sample(groomed).distance_m) - now_m : 0.0;
  };
  const std::vector<glm::vec3>& places = state.position_in_head_m;
  const std::vector<glm::vec3>& groomed = hair.rest_in_head_m();
  const size_t stride = hair.strand_count();
  Depths depths;
  for (size_t i = stride; i < places.size(); ++i)
    for (int k = 1; k <= kPlacesPerSegment; ++k) {
      const double share = static_cast<double>(k) / kPlacesPerSegment;
      const auto between = [&](const std::vector<glm::vec3>& points) {
        return glm::mix(glm::dvec3(points[i - stride]), glm::dvec3(points[i]), share);
      };
      double& deepest_m = k == kPlacesPerSegment ? depths.vertex_m : depths.between_m;
      deepest_m = std::max(deepest_m, depth_m(between(places), between(groomed)));
    }
  return depths;
}

/// Of the dance, in the head as it is drawn.
Depths danced(SceneDesc scene, const char* collider) {
  scene.head.collider = kFieldCollider;
  const auto field = load_scene_content(scene).value().head_field;
  scene.head.collider = collider;
  SceneContent content = std::move(load_scene_content(scene)).value();
  if (content.groom.strand_count() > kMostStrands) content.groom = first_strands(content.groom, kMostStrands);
  SteppedHair hair(scene, std::move(content));
  hair.move_bust();
  Depths depths;
  for (int i = 1; i <= static_cast<int>(kSeconds * scene.step_rate_hz); ++i) {
    InputFrame input;
    input.has_motion = true;
    input.world_from_head = dancing_head(i / scene.step_rate_hz);
    const SteppedState state = hair.step(input);
    const Depths now = deepest(*field, hair, state);
    depths = {std::max(depths.vertex_m, now.vertex_m), std::max(depths.between_m, now.between_m)};
  }
  return depths;
}

void expect_clean(const SceneDesc& scene) {
  const Depths depths = danced(scene, kFieldCollider);
  fmt::print("deepest vertex {:.2f} mm, between vertices {:.2f} mm\n", 1e3 * depths.vertex_m,
             1e3 * depths.between_m);
  EXPECT_LE(depths.vertex_m, 1e-3);
  EXPECT_LE(depths.between_m, 1e-3);
}

TEST(Fringe, TheBuiltInHairStaysOutOfTheFaceInADance) {
  SceneDesc scene = std::move(built_in_scene_with({"quality=full"})).value();
  std::get<ProceduralGroomDesc>(scene.groom).strand_count = kMostStrands;
  expect_clean(scene);
}

TEST(Fringe, AFringeStaysOutOfTheFaceInADance) {
  const std::filesystem::path file =
      std::filesystem::path(STRANDCAST_SHARED_DATA) / "grooms/sintel_11400x16.tfx";
  REQUIRE_SHARED(file);
  const SceneDesc scene =
      std::move(built_in_scene_with({"quality=full", "groom.file.path=" + file.string()})).value();
  expect_clean(scene);
  EXPECT_GT(danced(scene, kSphereCollider).vertex_m, 1e-3) << "on spheres it does not";
}

}  // namespace
}  // namespace strandcast::fringe_test
