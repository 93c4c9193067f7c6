// BustFollower: where the chest under a moving head is. With the motion's joints it is where they are; else
// it stands upright and turns to where the head looks, softly. Simulation thread; deterministic.
#pragma once

#include <complex>

#include "common/math/bust.h"
#include "common/scene/body_desc.h"

namespace strandcast {

/// Of two low passes one behind the other, s: a head that shakes at 2.2 Hz by 55 degrees moves the chest by
/// 2 degrees, 4 as it begins, and one that turns for good has the chest turned by nine tenths after 1.8 s.
inline constexpr double kBustLagS = 0.45;

class BustFollower {
 public:
  /// The head jumps, and takes neck and chest along as they are.
  void carry(const glm::dquat& world_from_head_before, const glm::dquat& world_from_head,
             const JointPlaces& joints);
  /// The head came here, evenly, within so long. `joints`: of the motion, head space.
  void follow(const glm::dquat& world_from_head, const JointPlaces& joints, double seconds);

  glm::dquat world_from_chest() const;

 private:
  /// Two low passes of the same lag: exact for inputs on a line, so steps of any length end at the same.
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
