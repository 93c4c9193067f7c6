// HeadMotion: apparent motion, in head space, of points at rest in the world during the head's last steps. It
// predicts how strands lag behind the head. Both sides of the "tangent" codec compute it from the poses in
// front of their frames. Private to common/strands/tangent; no I/O.
#pragma once

#include <array>
#include <cstddef>

#include "common/math/pose.h"

namespace strandcast::tangent {

inline constexpr size_t kHeadStepCount = 6;  // frames after which a step of the head is forgotten

/// Displacement of a point x along axis i: row[i][0..2] . x + row[i][3], in lattice steps.
struct HeadStep {
  std::array<std::array<double, 4>, 3> row{};
};

struct HeadMotion {
  Pose pose;
  std::array<HeadStep, kHeadStepCount> step{};  // newest first

  /// Returns the motion with a further step, to the pose of the next frame. Doubles in a fixed order give
  /// both sides the same bits.
  HeadMotion followed_by(const Pose& now, float quantum_m) const;
};

}  // namespace strandcast::tangent
