// Glitches of a motion capture: steps from one frame to the next that no head makes, and first frames that
// are not of the motion. Found, counted, and taken out. Any thread.
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

/// First frames are judged within this time, by what follows them for this long.
inline constexpr double kFirstFramesS = 0.1, kFirstFramesAfterS = 0.25;
/// A step out of them is so many times the median step of what follows, and at least as fast as this.
inline constexpr double kFirstFramesRatio = 6.0;
inline constexpr double kFirstFramesMps = 0.5;
inline constexpr double kFirstFramesDegPerS = 90.0;

/// Frames before a motion begins, as the T-pose that a capture was calibrated with.
struct FirstFrames {
  uint32_t count = 0;     // up to the last jump out of them
  double jump_m = 0.0;    // the longest
  double jump_deg = 0.0;  // the widest
};

/// Judges the first frames by the steps of the frames behind them; none in a clip that is too short for that.
FirstFrames find_first_frames(const MotionClip& clip);

/// Takes so many frames from the beginning of a clip that has more; its time begins with the next one.
void leave_out_first_frames(MotionClip& clip, uint32_t count);

}  // namespace strandcast
