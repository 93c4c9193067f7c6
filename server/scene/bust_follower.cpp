#include "server/scene/bust_follower.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

namespace strandcast {
namespace {

/// Shorter directions are none.
constexpr double kLeastDirection = 1e-6;
constexpr double kLeastBoneM = 0.01;

/// Direction that the rotation turns +Z to, seen from above: cosine and sine, smooth also where it looks up
/// or down.
std::complex<double> heading_of(const glm::dquat& q) {
  const std::complex<double> half(q.w, q.y);
  return half * half;
}

/// The rotation about +Y to there.
glm::dquat turned_to(const std::complex<double>& heading) {
  const double length = std::abs(heading);
  if (!(length > kLeastDirection)) return {1.0, 0.0, 0.0, 0.0};
  const double cosine = std::clamp(heading.real() / length, -1.0, 1.0);
  const double half = std::sqrt(0.5 * (1.0 + cosine));
  return {half, 0.0, std::copysign(std::sqrt(0.5 * (1.0 - cosine)), heading.imag()), 0.0};
}

std::optional<glm::dvec3> place_of(const JointPlaces& joints, const char* name) {
  const auto found = std::find(joints.name.begin(), joints.name.end(), name);
  if (found == joints.name.end()) return std::nullopt;
  return joints.place_m[static_cast<size_t>(found - joints.name.begin())];
}

/// A chest as upright as its spine, whose shoulders are where they are.
std::optional<glm::dquat> chest_of_joints(const JointPlaces& joints) {
  const auto neck = place_of(joints, kNeckJoint), chest = place_of(joints, kChestJoint);
  const auto left = place_of(joints, kLeftShoulderJoint), right = place_of(joints, kRightShoulderJoint);
  if (!neck || !chest || !left || !right) return std::nullopt;
  const glm::dvec3 spine_m = *neck - *chest;
  glm::dvec3 across_m = *left - *right;
  if (!(glm::length(spine_m) > kLeastBoneM)) return std::nullopt;
  const glm::dvec3 up = glm::normalize(spine_m);
  across_m -= glm::dot(across_m, up) * up;
  if (!(glm::length(across_m) > kLeastBoneM)) return std::nullopt;
  const glm::dvec3 side = glm::normalize(across_m);
  return glm::normalize(glm::quat_cast(glm::dmat3(side, up, glm::cross(side, up))));
}

}  // namespace

// x' = (u - x) / lag, y' = (x - y) / lag; u on a line from `input` to `next`.
void BustFollower::Lag::follow(const std::complex<double>& next, double seconds) {
  if (!(seconds > 0.0)) return rest_at(next);
  const double decay = std::exp(-seconds / kBustLagS);
  const std::complex<double> behind = (next - input) * (kBustLagS / seconds);
  const std::complex<double> first = once - input + behind;
  const std::complex<double> second = twice - input + 2.0 * behind;
  once = next - behind + decay * first;
  twice = next - 2.0 * behind + decay * (second + (seconds / kBustLagS) * first);
  input = next;
}

void BustFollower::rest_at(const glm::dquat& world_from_chest, const glm::dquat& world_from_head) {
  std::complex<double> heading = heading_of(world_from_chest);
  const double length = std::abs(heading);
  heading = length > kLeastDirection ? heading / length : 1.0;
  glm::dquat lean = glm::conjugate(turned_to(heading)) * world_from_chest;
  if (lean.w < 0.0) lean = -lean;
  heading_.rest_at(heading);
  heading_.input = heading_of(world_from_head);
  lean_.rest_at(std::complex<double>(lean.x, lean.z) / std::max(lean.w, kLeastDirection));
  lean_.input = 0.0;
}

void BustFollower::carry(const glm::dquat& world_from_head_before, const glm::dquat& world_from_head,
                         const JointPlaces& joints) {
  const glm::dquat head_from_chest =
      chest_of_joints(joints).value_or(glm::conjugate(world_from_head_before) * world_from_chest());
  rest_at(glm::normalize(world_from_head * head_from_chest), world_from_head);
}

void BustFollower::follow(const glm::dquat& world_from_head, const JointPlaces& joints, double seconds) {
  if (const auto chest = chest_of_joints(joints))
    return rest_at(glm::normalize(world_from_head * *chest), world_from_head);
  heading_.follow(heading_of(world_from_head), seconds);
  lean_.follow(0.0, seconds);
}

glm::dquat BustFollower::world_from_chest() const {
  const glm::dquat lean(1.0, lean_.twice.real(), 0.0, lean_.twice.imag());
  return turned_to(heading_.twice) * glm::normalize(lean);
}

}  // namespace strandcast
