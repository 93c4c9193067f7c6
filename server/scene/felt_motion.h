// FeltMotion: how much of a head's movement strands feel; with the rest they are carried rigidly. They feel
// less of inputs that pass faster than the simulation. A source that joins, comes back or leaves changes the
// head's speed from one step to the next, as no head can; they feel that difference over a second. Simulation
// thread; deterministic.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>

namespace strandcast {

/// Movement of a head in a step.
struct HeadMovement {
  glm::dvec3 shift_m{0.0};   // world
  glm::dvec3 turn_rad{0.0};  // axis times angle, world axes

  bool operator==(const HeadMovement&) const = default;
};

/// Steps after a cut from whose mean the head's new speed is taken: samples fall unevenly into single steps.
inline constexpr uint32_t kStepsAfterCut = 4;
/// Time in which strands come to feel the change of speed across a cut, s.
inline constexpr double kFeltChangeS = 1.0;

/// Returns the share of the head's motion in a step that strands feel, by its pace alone. It is 1 if inputs
/// pass no faster than simulated time. At input rate `rate` it is 1 / rate^2, so that accelerations keep
/// their true size: a step covers `rate` steps of motion, which would scale them by rate^2 and make hair
/// stand on end.
double felt_share(double rate);

class FeltMotion {
 public:
  /// Returns what strands feel of the head's movement in a step. `share`: of it at the pace of its inputs
  /// (felt_share()), 0 where the head jumped. `is_cut`: strands go on as they felt the step before.
  HeadMovement feel(const HeadMovement& moved, double share, bool is_cut, double step_s);

  /// Returns the share of the newest step's movement that strands feel, by pace and cut together; 1: they are
  /// not carried.
  double share() const { return share_; }

 private:
  // All as felt at the pace of the inputs.
  HeadMovement felt_;    // of the newest step
  HeadMovement seen_;    // since the cut
  HeadMovement beyond_;  // a step's movement after the cut, less that before it
  uint32_t unknown_steps_ = 0;
  double passed_s_ = kFeltChangeS;  // since the new speed is known
  double share_ = 1.0;
};

}  // namespace strandcast
