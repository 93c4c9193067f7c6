// ClipPath: playback of a clip of head motion. Motion begins from rest. In a loop the head is led from the
// clip's end back to its start, within the speeds and accelerations of the clip itself. Any thread. Does not
// read files (motion_file.h).
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "common/math/pose.h"
#include "common/motion/motion_clip.h"

namespace strandcast {

/// Shortest time in which a motion accelerates from rest, and shortest way back in a loop, in seconds.
inline constexpr double kClipBlendS = 0.3;
/// Longest time in which a motion accelerates from rest.
inline constexpr double kLongestStartS = 2.0;
/// Longest duration of the way back in a loop.
inline constexpr double kLongestWayBackS = 10.0;

/// Returns the time within a motion that starts from rest at t = 0. Its speed rises from 0 to 1 over
/// `blend_s`, twice differentiable; from then on it lags by half of `blend_s`. 0 starts at once.
double time_from_rest_s(double t_s, double blend_s);

/// Greatest speeds and accelerations between samples, of position and rotation.
struct MotionPeaks {
  double mps = 0.0;
  double mps2 = 0.0;
  double rad_per_s = 0.0;
  double rad_per_s2 = 0.0;

  /// Returns the larger of each pair of values.
  MotionPeaks with(const MotionPeaks& other) const;
  /// Returns whether no value exceeds `factor` times that of `other`.
  bool is_within(const MotionPeaks& other, double factor) const;
};

/// What a head reaches that gets under way without haste: half of gravity, and a nod.
inline constexpr MotionPeaks kEasyStart{.mps2 = 5.0, .rad_per_s2 = 20.0};

/// Returns the peaks of poses that are `step_s` apart. With a `share` below 1, the values that this share of
/// the samples does not exceed.
MotionPeaks peaks_of(const std::vector<Pose>& poses, double step_s, double share = 1.0);

struct ClipPathOptions {
  bool is_looped = false;
  double blend_s =
      kClipBlendS;  // at least; 0: the clip as it is, with a jump where it begins and starts over
};

class ClipPath {
 public:
  ClipPath(MotionClip clip, const ClipPathOptions& options);

  /// Returns the pose at playing time t; after the end of a clip that is not looped, its last pose.
  Pose sample(double t_s) const;
  /// Returns the positions of the clip's joints at playing time t, in head space, m; like sample().
  std::vector<glm::dvec3> sample_joints(double t_s) const;
  /// Returns the time at which the clip's last pose is first reached, s.
  double duration_s() const;
  /// Returns the duration of the head's way from the clip's end to its start, s; 0 if it is not looped or not
  /// blended.
  double way_back_s() const { return way_back_s_; }
  /// Returns how long the motion is blended in from rest, s: as short as an easy start's accelerations allow,
  /// at most kLongestStartS; 0 without blending.
  double start_s() const { return start_s_; }
  const MotionClip& clip() const { return clip_; }

 private:
  double place_in_loop_s(double t_s) const;
  Pose way_back(double passed_s, double whole_s) const;
  double choose_way_back_s() const;
  double choose_start_s() const;

  MotionClip clip_;
  ClipPathOptions options_;
  glm::dvec3 end_mps_{0.0}, start_mps_{0.0};              // of the head at the clip's end and start
  glm::dvec3 end_rad_per_s_{0.0}, start_rad_per_s_{0.0};  // world axes
  double way_back_s_ = 0.0;
  double start_s_ = 0.0;
};

}  // namespace strandcast
