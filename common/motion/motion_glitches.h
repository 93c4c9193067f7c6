// Glitches of motion capture: steps between frames that no head can make, and first frames that are not part
// of the motion. Finds, counts and removes them. Any thread.
#pragma once

#include <cstdint>

#include "common/motion/motion_clip.h"

namespace strandcast {

/// Fastest plausible head motion. A sprinter's head moves at 12 m/s, and the fastest rotations in known takes
/// are below 2,000 degrees/s.
inline constexpr double kMaxHeadMps = 15.0;
inline constexpr double kMaxHeadDegPerS = 3000.0;

struct MotionGlitches {
  uint32_t step_count = 0;   // steps beyond either limit
  double first_s = 0.0;      // where the first of them begins
  double fastest_mps = 0.0;  // of all steps
  double fastest_deg_per_s = 0.0;
};

MotionGlitches find_glitches(const MotionClip& clip);

/// Replaces every frame that the last good one cannot reach within the limits by an interpolation of the good
/// frames around it. At the end the last good frame is held. Returns the number of replaced frames;
/// find_glitches() then finds none.
uint32_t filter_glitches(MotionClip& clip);

/// Time at the beginning of a clip that is searched for wrong first frames, and time after it that they are
/// compared with.
inline constexpr double kFirstFramesS = 0.1, kFirstFramesAfterS = 0.25;
/// A jump out of the first frames exceeds the median step of the following frames by this ratio, and this
/// speed.
inline constexpr double kFirstFramesRatio = 6.0;
inline constexpr double kFirstFramesMps = 0.5;
inline constexpr double kFirstFramesDegPerS = 90.0;

/// Frames before a motion begins, for example a calibration pose (T-pose).
struct FirstFrames {
  uint32_t count = 0;     // up to the last jump out of them
  double jump_m = 0.0;    // the longest
  double jump_deg = 0.0;  // the widest
};

/// Finds wrong first frames, however long the first is held, by comparing their steps with those of later
/// frames; none if the clip is too short for that.
FirstFrames find_first_frames(const MotionClip& clip);

/// Removes `count` frames from the beginning of a longer clip; time then begins with the next frame.
void leave_out_first_frames(MotionClip& clip, uint32_t count);

}  // namespace strandcast
