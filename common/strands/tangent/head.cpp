#include "common/strands/tangent/head.h"

#include <algorithm>

namespace strandcast::tangent {
namespace {

using Matrix = std::array<std::array<double, 3>, 3>;

/// Rotation by q, less the identity.
Matrix turn_of(const glm::dquat& q) {
  return {{{-2.0 * (q.y * q.y + q.z * q.z), 2.0 * (q.x * q.y - q.w * q.z), 2.0 * (q.x * q.z + q.w * q.y)},
           {2.0 * (q.x * q.y + q.w * q.z), -2.0 * (q.x * q.x + q.z * q.z), 2.0 * (q.y * q.z - q.w * q.x)},
           {2.0 * (q.x * q.z - q.w * q.y), 2.0 * (q.y * q.z + q.w * q.x), -2.0 * (q.x * q.x + q.y * q.y)}}};
}

/// Rotation by b, then back by a.
glm::dquat after_undoing(const glm::dquat& a, const glm::dquat& b) {
  return {
      ((a.w * b.w + a.x * b.x) + a.y * b.y) + a.z * b.z, ((a.w * b.x - a.x * b.w) - a.y * b.z) + a.z * b.y,
      ((a.w * b.y - a.y * b.w) - a.z * b.x) + a.x * b.z, ((a.w * b.z - a.z * b.w) - a.x * b.y) + a.y * b.x};
}

}  // namespace

HeadMotion HeadMotion::followed_by(const Pose& now, float quantum_m) const {
  constexpr double kFarthest = 1e9;  // in lattice steps; no prediction reaches farther
  HeadMotion next;
  next.pose = now;
  std::copy(step.begin(), step.end() - 1, next.step.begin() + 1);
  const Matrix turn = turn_of(after_undoing(now.rotation, pose.rotation));
  const Matrix back = turn_of(glm::dquat(now.rotation.w, -now.rotation.x, -now.rotation.y, -now.rotation.z));
  const glm::dvec3 moved = (pose.position_m - now.position_m) / static_cast<double>(quantum_m);
  for (size_t i = 0; i < 3; ++i) {
    std::copy(turn[i].begin(), turn[i].end(), next.step[0].row[i].begin());
    const double turned = (back[i][0] * moved.x + back[i][1] * moved.y) + back[i][2] * moved.z;
    next.step[0].row[i][3] = std::clamp(moved[static_cast<int>(i)] + turned, -kFarthest, kFarthest);
  }
  return next;
}

}  // namespace strandcast::tangent
