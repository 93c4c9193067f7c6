// Glitches of a motion capture: steps from one frame to the next that no head makes. Found, counted, and on
// request taken out. Any thread.
#pragma once

#include <cstdint>

#include "common/motion/motion_clip.h"

namespace strandcast {

/// A sprinter's head moves at 12 m/s, and the fastest turns of the takes at hand are below 2,000 degrees/s.
inline constexpr double kMaxHeadMps = 15.0;
inline constexpr double kMaxHeadDegPerS = 3000.0;

struct MotionGlitches {
  uint32_t step_count = 0;   // steps beyond either limit
  double first_s = 0.0;      // where the first of them begins
  double fastest_mps = 0.0;  // of all steps
  double fastest_deg_per_s = 0.0;
};

MotionGlitches find_glitches(const MotionClip& clip);

/// Replaces every frame that cannot be reached from the last good one within the limits by what lies between
/// the good frames around it; at the end the last good one stays. Returns how many frames were replaced;
/// find_glitches() then finds none.
uint32_t filter_glitches(MotionClip& clip);

}  // namespace strandcast
