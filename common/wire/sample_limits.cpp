#include "common/wire/sample_limits.h"

#include <fmt/format.h>

#include "common/scene/body_desc.h"

namespace strandcast {

std::string refusal_of(const Pose& world_from_head) {
  if (!is_finite(world_from_head)) return "the head's pose is no number";
  const double norm = glm::length(world_from_head.rotation);
  if (norm < kMinQuaternionNorm || norm > kMaxQuaternionNorm)
    return fmt::format("the head's quaternion has the length {:.3g}, not 1", norm);
  const double distance_m = glm::length(world_from_head.position_m);
  if (distance_m <= kMaxHeadDistanceM) return {};
  return fmt::format("the head is {:.4g} m from the origin, and {:g} m at most are believed", distance_m,
                     kMaxHeadDistanceM);
}

std::string refusal_of(const MotionSamples::Sample& sample, size_t joint_count) {
  if (std::string refusal = refusal_of(sample.world_from_head); !refusal.empty()) return refusal;
  if (sample.joint_m.empty()) return {};
  if (sample.joint_m.size() != joint_count || joint_count > kMaxMotionJoints)
    return fmt::format("{} joints of the body have {} names", sample.joint_m.size(), joint_count);
  for (const glm::dvec3 place_m : sample.joint_m)
    if (const double distance_m = glm::length(place_m); !(distance_m <= kMaxJointDistanceM))
      return fmt::format("a joint of the body is {:.4g} m from the head, and {:g} m at most are believed",
                         distance_m, kMaxJointDistanceM);
  return {};
}

}  // namespace strandcast
