// BustFollower: computes the pose of the chest under a moving head. It uses the motion's joints if there are
// any. Otherwise the chest stays upright and turns smoothly towards where the head looks. Simulation thread;
// deterministic.
#pragma once

#include <complex>

#include "common/math/bust.h"
#include "common/scene/body_desc.h"

namespace strandcast {

/// Time constant of each of two successive low-pass filters, s. A head that shakes at 2.2 Hz by 55 degrees
/// moves the chest by 2 degrees (4 at first). After a lasting turn the chest has followed by nine tenths in
/// 1.8 s.
inline constexpr double kBustLagS = 0.45;

class BustFollower {
 public:
  /// Moves neck and chest rigidly with a head that jumps.
  void carry(const glm::dquat& world_from_head_before, const glm::dquat& world_from_head,
             const JointPlaces& joints);
  /// Follows the head, which moved evenly to this rotation within `seconds`. `joints`: of the motion, head
  /// space.
  void follow(const glm::dquat& world_from_head, const JointPlaces& joints, double seconds);

  glm::dquat world_from_chest() const;

 private:
  /// Two low-pass filters of equal lag; exact for inputs on a line, so step length does not change the
  /// result.
  struct Lag {
    std::complex<double> input, once, twice;

    void follow(const std::complex<double>& next, double seconds);
    void rest_at(const std::complex<double>& place) { input = once = twice = place; }
  };

  void rest_at(const glm::dquat& world_from_chest, const glm::dquat& world_from_head);

  Lag heading_ = {1.0, 1.0, 1.0};  // direction that is looked in: towards +Z, +X; shorter when upside down
  Lag lean_;                       // forwards and sideways, as tangents of half the angle
};

}  // namespace strandcast
