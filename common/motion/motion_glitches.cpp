#include "common/motion/motion_glitches.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/base/quantile.h"

namespace strandcast {
namespace {

/// Of a movement that takes `duration_s`.
struct HeadSpeed {
  double mps = 0.0;
  double deg_per_s = 0.0;

  bool is_possible() const { return mps <= kMaxHeadMps && deg_per_s <= kMaxHeadDegPerS; }
};

HeadSpeed speed_of(const Pose& from, const Pose& to, double duration_s) {
  return {glm::distance(from.position_m, to.position_m) / duration_s,
          glm::degrees(angle_between_rad(from.rotation, to.rotation)) / duration_s};
}

}  // namespace

MotionGlitches find_glitches(const MotionClip& clip) {
  MotionGlitches glitches;
  for (size_t i = 1; i < clip.world_from_head.size(); ++i) {
    const HeadSpeed speed = speed_of(clip.world_from_head[i - 1], clip.world_from_head[i], clip.frame_s);
    glitches.fastest_mps = std::max(glitches.fastest_mps, speed.mps);
    glitches.fastest_deg_per_s = std::max(glitches.fastest_deg_per_s, speed.deg_per_s);
    if (speed.is_possible()) continue;
    if (glitches.step_count++ == 0) glitches.first_s = static_cast<double>(i - 1) * clip.frame_s;
  }
  return glitches;
}

uint32_t filter_glitches(MotionClip& clip) {
  // A little below the limit, so that what is put between does not round to above it.
  constexpr double kRoom = 1.0 + 1e-6;
  std::vector<Pose>& poses = clip.world_from_head;
  uint32_t replaced = 0;
  size_t good = 0;  // the last frame that is as it was
  for (size_t i = 1; i < poses.size(); ++i) {
    const double passed_s = clip.frame_s * static_cast<double>(i - good);
    if (!speed_of(poses[good], poses[i], passed_s / kRoom).is_possible()) continue;
    for (size_t k = good + 1; k < i; ++k) {
      const double blend = static_cast<double>(k - good) / static_cast<double>(i - good);
      poses[k] = interpolate(poses[good], poses[i], blend);
      ++replaced;
    }
    good = i;
  }
  for (size_t k = good + 1; k < poses.size(); ++k, ++replaced) poses[k] = poses[good];
  return replaced;
}

FirstFrames find_first_frames(const MotionClip& clip) {
  constexpr size_t kFewestAfter = 4;
  const std::vector<Pose>& poses = clip.world_from_head;
  const auto frames_in = [&](double time_s) {
    return static_cast<size_t>(std::lround(time_s / clip.frame_s));
  };
  // A calibration pose may be held for long: frames that are the first one again.
  const auto moves =
      std::find_if(poses.begin(), poses.end(), [&](const Pose& pose) { return pose != poses[0]; });
  const auto held = static_cast<size_t>(moves - poses.begin());
  const size_t judged = std::max({frames_in(kFirstFramesS), held, size_t{1}});
  const size_t after = std::max(frames_in(kFirstFramesAfterS), kFewestAfter);
  FirstFrames first;
  if (poses.size() <= judged + after) return first;
  const auto step = [&](size_t i) { return speed_of(poses[i], poses[i + 1], clip.frame_s); };
  std::vector<double> mps, deg_per_s;
  for (size_t i = judged; i < judged + after; ++i) {
    mps.push_back(step(i).mps);
    deg_per_s.push_back(step(i).deg_per_s);
  }
  const double most_mps = std::max(kFirstFramesMps, kFirstFramesRatio * median(std::move(mps)));
  const double most_deg_per_s =
      std::max(kFirstFramesDegPerS, kFirstFramesRatio * median(std::move(deg_per_s)));
  for (size_t i = 0; i < judged; ++i) {
    const HeadSpeed speed = step(i);
    if (speed.mps <= most_mps && speed.deg_per_s <= most_deg_per_s) continue;
    first.count = static_cast<uint32_t>(i + 1);
    first.jump_m = std::max(first.jump_m, speed.mps * clip.frame_s);
    first.jump_deg = std::max(first.jump_deg, speed.deg_per_s * clip.frame_s);
  }
  return first;
}

void leave_out_first_frames(MotionClip& clip, uint32_t count) {
  const auto frames = static_cast<std::ptrdiff_t>(count);
  clip.world_from_head.erase(clip.world_from_head.begin(), clip.world_from_head.begin() + frames);
  if (clip.joint_m.empty()) return;
  const auto joints = static_cast<std::ptrdiff_t>(clip.joint_name.size());
  clip.joint_m.erase(clip.joint_m.begin(), clip.joint_m.begin() + frames * joints);
}

}  // namespace strandcast
