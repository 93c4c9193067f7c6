#include "common/math/pose.h"

#include <algorithm>
#include <cmath>

namespace strandcast {

bool is_finite(const Pose& pose) {
  const glm::dvec3& p = pose.position_m;
  const glm::dquat& q = pose.rotation;
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z) && std::isfinite(q.w) &&
         std::isfinite(q.x) && std::isfinite(q.y) && std::isfinite(q.z);
}

Pose interpolate(const Pose& a, const Pose& b, double blend) {
  Pose result;
  result.position_m = glm::mix(a.position_m, b.position_m, blend);
  result.rotation = glm::normalize(glm::slerp(a.rotation, b.rotation, blend));
  return result;
}

double angle_between_rad(const glm::dquat& a, const glm::dquat& b) {
  const double cosine = std::abs(glm::dot(a, b));
  return 2.0 * std::acos(std::min(1.0, cosine));
}

}  // namespace strandcast
