#include "common/motion/clip_path.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/quantile.h"
#include "common/math/turn.h"

namespace strandcast {
namespace {

// The head goes on from the clip's end as it moved there, and comes to rest in at most this time; likewise it
// gets under way before the start.
constexpr double kCoastS = 0.6;
// From one length of the way back to the next that is tried.
constexpr double kLonger = 1.2;
// Steps of the simulation, about: what is shorter no strand feels.
constexpr double kStartSampleS = 1.0 / 60.0;
// Of the clip's speeds and accelerations, what this share keeps to: the rest may be the capture's noise.
constexpr double kUsualShare = 0.98;
// A clip that hardly moves is no measure: a way back may always be as lively as this.
constexpr MotionPeaks kGentle{0.1, 1.0, 0.5, 5.0};

/// Integral of ease() from 0 to x, for x within 0..1: 1/2 at 1.
double eased_area(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * x * x * (2.5 + x * (x - 3.0));
}

/// How far what has speed 1 and comes to rest in `coast_s` gets in the time that passed.
double coasted_s(double passed_s, double coast_s) {
  const double x = std::clamp(passed_s / coast_s, 0.0, 1.0);
  return coast_s * (x - eased_area(x));
}

}  // namespace

double time_from_rest_s(double t_s, double blend_s) {
  if (!(blend_s > 0.0) || t_s <= 0.0) return t_s;
  return t_s < blend_s ? blend_s * eased_area(t_s / blend_s) : t_s - 0.5 * blend_s;
}

MotionPeaks MotionPeaks::with(const MotionPeaks& other) const {
  return {std::max(mps, other.mps), std::max(mps2, other.mps2), std::max(rad_per_s, other.rad_per_s),
          std::max(rad_per_s2, other.rad_per_s2)};
}

bool MotionPeaks::is_within(const MotionPeaks& other, double factor) const {
  return mps <= factor * other.mps && mps2 <= factor * other.mps2 && rad_per_s <= factor * other.rad_per_s &&
         rad_per_s2 <= factor * other.rad_per_s2;
}

MotionPeaks peaks_of(const std::vector<Pose>& poses, double step_s, double share) {
  std::vector<double> mps, mps2, rad_per_s, rad_per_s2;
  glm::dvec3 before_mps(0.0), before_rad_per_s(0.0);
  for (size_t i = 1; i < poses.size(); ++i) {
    const glm::dvec3 moved_mps = (poses[i].position_m - poses[i - 1].position_m) / step_s;
    const glm::dvec3 turned_rad_per_s = turn_between(poses[i - 1].rotation, poses[i].rotation) / step_s;
    mps.push_back(glm::length(moved_mps));
    rad_per_s.push_back(glm::length(turned_rad_per_s));
    if (i > 1) {
      mps2.push_back(glm::distance(moved_mps, before_mps) / step_s);
      rad_per_s2.push_back(glm::distance(turned_rad_per_s, before_rad_per_s) / step_s);
    }
    before_mps = moved_mps;
    before_rad_per_s = turned_rad_per_s;
  }
  return {quantile(std::move(mps), share), quantile(std::move(mps2), share),
          quantile(std::move(rad_per_s), share), quantile(std::move(rad_per_s2), share)};
}

ClipPath::ClipPath(MotionClip clip, const ClipPathOptions& options)
    : clip_(std::move(clip)), options_(options) {
  const std::vector<Pose>& poses = clip_.world_from_head;
  if (options_.blend_s > 0.0) start_s_ = choose_start_s();
  if (!options_.is_looped || !(options_.blend_s > 0.0) || poses.size() < 2) return;
  const Pose &first = poses[0], &second = poses[1];
  const Pose &last = poses.back(), &before = poses[poses.size() - 2];
  start_mps_ = (second.position_m - first.position_m) / clip_.frame_s;
  end_mps_ = (last.position_m - before.position_m) / clip_.frame_s;
  start_rad_per_s_ = turn_between(first.rotation, second.rotation) / clip_.frame_s;
  end_rad_per_s_ = turn_between(before.rotation, last.rotation) / clip_.frame_s;
  way_back_s_ = choose_way_back_s();
}

double ClipPath::duration_s() const {
  return clip_.duration_s() + 0.5 * start_s_;
}

/// Time of the clip; beyond its duration it is on the way back.
double ClipPath::place_in_loop_s(double t_s) const {
  const double played_s = time_from_rest_s(t_s, start_s_);
  const double period_s = clip_.duration_s() + way_back_s_;
  return options_.is_looped && period_s > 0.0 ? std::fmod(played_s, period_s) : played_s;
}

/// Two ways of the head, on from the end and towards the start, each at rest away from the clip; the one goes
/// over into the other. So place and speed are the clip's at both ends, and there is no acceleration.
Pose ClipPath::way_back(double passed_s, double whole_s) const {
  const double coast_s = std::min(kCoastS, whole_s);
  const double on_s = coasted_s(passed_s, coast_s);
  const double towards_s = coasted_s(whole_s - passed_s, coast_s);
  const double blend = ease(passed_s / whole_s);
  const Pose &end = clip_.world_from_head.back(), &start = clip_.world_from_head.front();
  Pose pose;
  pose.position_m =
      glm::mix(end.position_m + on_s * end_mps_, start.position_m - towards_s * start_mps_, blend);
  // The side on which one rotation goes over into the other is chosen once: it must not change on the way.
  const double all_s = coasted_s(coast_s, coast_s);
  const double side = glm::dot(turned(end.rotation, all_s * end_rad_per_s_),
                               turned(start.rotation, -all_s * start_rad_per_s_)) < 0.0
                          ? -1.0
                          : 1.0;
  const glm::dquat to = turned(start.rotation, -towards_s * start_rad_per_s_) * side;
  pose.rotation = glm::normalize(glm::mix(turned(end.rotation, on_s * end_rad_per_s_), to, blend));
  return pose;
}

/// Returns the shortest easy start; the longest for a clip too violent for any, since hair moves by then.
double ClipPath::choose_start_s() const {
  for (double wanted_s = options_.blend_s;; wanted_s *= kLonger) {
    if (wanted_s >= kLongestStartS) return std::max(options_.blend_s, kLongestStartS);
    std::vector<Pose> start(2, clip_.sample(0.0));
    for (double t_s = 0.0; t_s < wanted_s; t_s += kStartSampleS)
      start.push_back(clip_.sample(time_from_rest_s(t_s, wanted_s)));
    const MotionPeaks peaks = peaks_of(start, kStartSampleS);
    if (peaks.mps2 <= kEasyStart.mps2 && peaks.rad_per_s2 <= kEasyStart.rad_per_s2) return wanted_s;
  }
}

/// As short as the clip's own speeds and accelerations allow; whole frames.
double ClipPath::choose_way_back_s() const {
  const std::vector<Pose>& poses = clip_.world_from_head;
  const MotionPeaks at_ends = peaks_of({poses[0], poses[1]}, clip_.frame_s)
                                  .with(peaks_of({poses[poses.size() - 2], poses.back()}, clip_.frame_s));
  const MotionPeaks most = peaks_of(poses, clip_.frame_s, kUsualShare).with(at_ends).with(kGentle);
  for (double wanted_s = options_.blend_s;; wanted_s *= kLonger) {
    const double count = std::max(2.0, std::ceil(wanted_s / clip_.frame_s));
    const double whole_s = count * clip_.frame_s;
    // With the frames before and behind it.
    std::vector<Pose> way{poses[poses.size() - 2]};
    for (double i = 0.0; i <= count; ++i) way.push_back(way_back(i * clip_.frame_s, whole_s));
    way.push_back(poses[1]);
    if (wanted_s >= kLongestWayBackS || peaks_of(way, clip_.frame_s).is_within(most, 1.0)) return whole_s;
  }
}

Pose ClipPath::sample(double t_s) const {
  const double at_s = place_in_loop_s(t_s);
  const double passed_s = at_s - clip_.duration_s();
  return way_back_s_ > 0.0 && passed_s > 0.0 ? way_back(passed_s, way_back_s_) : clip_.sample(at_s);
}

std::vector<glm::dvec3> ClipPath::sample_joints(double t_s) const {
  const double at_s = place_in_loop_s(t_s);
  std::vector<glm::dvec3> places = clip_.sample_joints(at_s);
  const double passed_s = at_s - clip_.duration_s();
  if (!(way_back_s_ > 0.0) || passed_s <= 0.0 || places.empty()) return places;
  const std::vector<glm::dvec3> first = clip_.sample_joints(0.0);
  for (size_t i = 0; i < places.size(); ++i)
    places[i] = glm::mix(places[i], first[i], ease(passed_s / way_back_s_));
  return places;
}

}  // namespace strandcast
