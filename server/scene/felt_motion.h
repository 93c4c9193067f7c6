// FeltMotion: how much of a head's movement strands feel after a cut. A source that joins, comes back or
// leaves changes the head's speed from one step to the next, as no head can. Strands are carried through that
// difference and feel it over a second. Simulation thread; deterministic.
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

class FeltMotion {
 public:
  /// Returns the part of a step's movement that strands feel; with the rest they are carried rigidly.
  /// `is_cut`: the head's way of this step is a jump, and strands go on as in the step before.
  HeadMovement feel(const HeadMovement& moved, bool is_cut, double step_s);

  /// Returns the share of the change of speed that strands feel by now: 0 at a cut, 1 from kFeltChangeS on.
  double share() const { return share_; }

 private:
  HeadMovement felt_;    // of the newest step
  HeadMovement seen_;    // since the cut
  HeadMovement beyond_;  // a step's movement after the cut, less that before it
  uint32_t unknown_steps_ = 0;
  double passed_s_ = kFeltChangeS;  // since the new speed is known
  double share_ = 1.0;
};

}  // namespace strandcast
