// HeadMotion: what the head's last steps would do to points at rest in the world, seen in head space. Both
// sides of the "tangent" codec know it from the poses in front of their frames, before any vertex: strands
// lag behind the head. Private to common/strands/tangent; no I/O.
#pragma once

#include <array>
#include <cstddef>

#include "common/math/pose.h"

namespace strandcast::tangent {

inline constexpr size_t kHeadStepCount = 6;  // frames after which a step of the head is forgotten

/// Change of position of a point x: row[i][0..2] . x + row[i][3] along axis i, in lattice steps.
struct HeadStep {
  std::array<std::array<double, 4>, 3> row{};
};

struct HeadMotion {
  Pose pose;
  std::array<HeadStep, kHeadStepCount> step{};  // newest first

  /// With one more step, to the pose of the next frame. The same bits on both sides: doubles, in a fixed
  /// order.
  HeadMotion followed_by(const Pose& now, float quantum_m) const;
};

}  // namespace strandcast::tangent
