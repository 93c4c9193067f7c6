#include "common/math/pose_lattice.h"

#include <cmath>
#include <cstring>

namespace strandcast {
namespace {

constexpr double kMostUnits = 1e9;

std::array<double, 7> numbers_of(const Pose& pose) {
  const glm::dvec3& p = pose.position_m;
  const glm::dquat& q = pose.rotation;
  return {p.x, p.y, p.z, q.w, q.x, q.y, q.z};
}

std::optional<PoseSteps> nearest_steps(const Pose& pose) {
  const std::array<double, 7> numbers = numbers_of(pose);
  PoseSteps steps;
  for (size_t i = 0; i < numbers.size(); ++i) {
    if (!(std::abs(numbers[i]) <= kMostUnits)) return std::nullopt;
    steps[i] = static_cast<int64_t>(std::nearbyint(numbers[i] * kPoseStepsPerUnit));
  }
  return steps;
}

}  // namespace

Pose rounded_pose(const Pose& pose) {
  const std::optional<PoseSteps> steps = nearest_steps(pose);
  return steps ? pose_of(*steps) : pose;
}

std::optional<PoseSteps> pose_steps(const Pose& pose) {
  const std::optional<PoseSteps> steps = nearest_steps(pose);
  if (!steps) return std::nullopt;
  const std::array<double, 7> given = numbers_of(pose);
  const std::array<double, 7> back = numbers_of(pose_of(*steps));
  if (std::memcmp(given.data(), back.data(), sizeof given) != 0) return std::nullopt;
  return steps;
}

Pose pose_of(const PoseSteps& steps) {
  const auto unit = [&](size_t i) { return static_cast<double>(steps[i]) / kPoseStepsPerUnit; };
  return {{unit(0), unit(1), unit(2)}, {unit(3), unit(4), unit(5), unit(6)}};
}

}  // namespace strandcast
