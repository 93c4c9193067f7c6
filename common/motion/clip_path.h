// ClipPath: a clip of head motion as it is played. It begins from rest, and where it is looped the head is
// led from the clip's end back to its start, at no more than the speeds and accelerations that the clip has
// itself. Any thread. Does not read files (motion_file.h).
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "common/math/pose.h"
#include "common/motion/motion_clip.h"

namespace strandcast {

/// Over this time a motion sets in, and at least so long is the way back of a loop.
inline constexpr double kClipBlendS = 0.3;
/// A way back takes no longer, however far it is.
inline constexpr double kLongestWayBackS = 10.0;

/// Motion time at time t of a motion that sets in over `blend_s`: its speed rises from 0 to 1, twice
/// differentiable. From then on it is half of `blend_s` behind. 0 = at once.
double time_from_rest_s(double t_s, double blend_s);

/// Fastest movement and strongest acceleration from sample to sample, of place and of rotation.
struct MotionPeaks {
  double mps = 0.0;
  double mps2 = 0.0;
  double rad_per_s = 0.0;
  double rad_per_s2 = 0.0;

  /// The larger of both, each by itself.
  MotionPeaks with(const MotionPeaks& other) const;
  /// True where none is larger than `factor` times that of `other`.
  bool is_within(const MotionPeaks& other, double factor) const;
};

/// Of poses that are `step_s` apart. A `share` below 1 gives what that share of them keeps to.
MotionPeaks peaks_of(const std::vector<Pose>& poses, double step_s, double share = 1.0);

struct ClipPathOptions {
  bool is_looped = false;
  double blend_s = kClipBlendS;  // 0: the clip as it is, with a jump where it begins and starts over
};

class ClipPath {
 public:
  ClipPath(MotionClip clip, const ClipPathOptions& options);

  /// Pose at time t of playing; beyond the end of a clip that is not looped its last pose.
  Pose sample(double t_s) const;
  /// Places of the clip's joints at time t, likewise; head space, m.
  std::vector<glm::dvec3> sample_joints(double t_s) const;
  /// When the clip's last pose is reached for the first time, s.
  double duration_s() const;
  /// How long the head takes from the end to the start, s; 0 where it is not looped or not blended.
  double way_back_s() const { return way_back_s_; }
  const MotionClip& clip() const { return clip_; }

 private:
  double place_in_loop_s(double t_s) const;
  Pose way_back(double passed_s, double whole_s) const;
  double choose_way_back_s() const;

  MotionClip clip_;
  ClipPathOptions options_;
  glm::dvec3 end_mps_{0.0}, start_mps_{0.0};              // of the head at the clip's end and start
  glm::dvec3 end_rad_per_s_{0.0}, start_rad_per_s_{0.0};  // world axes
  double way_back_s_ = 0.0;
};

}  // namespace strandcast
