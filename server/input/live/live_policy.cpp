#include "server/input/live/live_policy.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/units.h"
#include "common/math/turn.h"
#include "common/scene/body_desc.h"
#include "common/wire/sample_limits.h"
#include "server/input/input_hub.h"

namespace strandcast {
namespace {

constexpr int64_t kBetweenJumpsNs = 1'000'000;  // the hub sees a jump where two samples are this near
constexpr int64_t kShortestStepNs = 1'000;      // between two poses
constexpr uint32_t kSteadyCount = 8;            // equal steps in a row that make a habit
constexpr double kSteadyShare = 0.2;            // how much periods of a steady source differ
constexpr double kLeastTurn = 1e-9;             // of a quaternion's vector part

bool is_possible(const LivePose& pose) {
  return refusal_of(pose.world_from_subject).empty();
}

/// As a tracker tells that has lost what it tracks.
bool is_of_zeros(const Pose& seen) {
  return seen.position_m == glm::dvec3(0.0) && std::abs(seen.rotation.w) == 1.0;
}

/// The part of a rotation that is about +Y.
glm::dquat heading_of(const glm::dquat& rotation) {
  const double norm = std::hypot(rotation.w, rotation.y);
  if (norm < kLeastTurn) return {1.0, 0.0, 0.0, 0.0};
  return {rotation.w / norm, 0.0, rotation.y / norm, 0.0};
}

/// From 0 to 1, at rest at both ends.
double eased_share(double share) {
  const double t = std::clamp(share, 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

}  // namespace

// ---- what comes

void LivePolicy::take(const LivePose& pose, int64_t arrival_ns) {
  if (!is_possible(pose)) {
    ++counters_.impossible;
    return;
  }
  LivePose fit = pose;
  fit.world_from_subject.rotation = glm::normalize(fit.world_from_subject.rotation);
  if (is_stale(arrival_ns)) {
    forget_order();
    jumps_ = jumps_ || !last_;
    doubted_.reset();
  }
  leave_out_stalled_time(fit);
  order(fit, arrival_ns);
}

/// A time that stood still while the pose changed is none: of a sender that counts in large steps, or tells
/// it once for many poses.
void LivePolicy::leave_out_stalled_time(LivePose& pose) {
  if (!pose.source_time_ns) return;
  const bool is_same_time = told_ && told_->source_time_ns == pose.source_time_ns;
  const bool is_repeated =
      is_same_time && told_->frame == pose.frame && told_->world_from_subject == pose.world_from_subject;
  if (is_repeated) return;
  told_ = pose;
  if (++told_poses_ > kStallWindowPoses) told_poses_ = stalled_poses_ = 0;
  if (is_same_time && ++stalled_poses_ >= kStalledPoses && !std::exchange(has_no_times_, true))
    notes_.emplace_back("the sender's times stand still while its poses change: times of arrival are used");
  if (is_same_time || has_no_times_) pose.source_time_ns.reset();
}

std::vector<LiveHead> LivePolicy::advance(int64_t now_ns) {
  while (!waiting_.empty() && now_ns - waiting_.front().arrival_ns >= kResequenceNs) release_first();
  return std::exchange(due_, {});
}

bool LivePolicy::is_stale(int64_t now_ns) const {
  return !seen_ || now_ns - seen_ns_ > kMotionStaleNs;
}

void LivePolicy::begin_another() {
  forget_order();
  told_.reset();
  told_poses_ = stalled_poses_ = 0;
  has_no_times_ = false;
  seen_.reset();
  doubted_.reset();
  is_lost_ = false;
  jumps_ = true;
}

bool LivePolicy::calibrate(int64_t now_ns) {
  if (is_stale(now_ns)) return false;
  Calibration calibration;
  const glm::dquat heading = heading_of(seen_->rotation);
  calibration.from_stage = glm::conjugate(heading);
  calibration.from_mount = glm::conjugate(calibration.from_stage * seen_->rotation);
  calibration.origin_m = seen_->position_m;
  calibration_ = calibration;
  jumps_ = true;
  return true;
}

void LivePolicy::reset_calibration() {
  calibration_.reset();
  jumps_ = true;
}

// ---- order

void LivePolicy::forget_order() {
  waiting_.clear();
  last_frame_.reset();
  last_source_ns_.reset();
  stride_ = 1;
  last_gap_ = 0;
  equal_gaps_ = 0;
  late_in_a_row_ = 0;
  steady_periods_ = 0;
  period_ns_ = 0.0;
  clock_ = {};
}

/// How many places this pose comes after the one that is expected; negative: it is late. Nothing where that
/// is not known.
std::optional<int64_t> LivePolicy::places_ahead(const LivePose& pose) const {
  if (pose.frame && last_frame_) {
    const auto after = static_cast<int64_t>(static_cast<int32_t>(*pose.frame - *last_frame_));
    if (after <= 0) return after - 1;
    return after < stride_ ? 0 : (after - 1) / stride_;
  }
  if (pose.frame || !pose.source_time_ns || !last_source_ns_) return std::nullopt;
  const double after_ns = static_cast<double>(*pose.source_time_ns) - static_cast<double>(*last_source_ns_);
  if (after_ns <= 0.0) return -1;
  if (steady_periods_ < kSteadyCount) return 0;
  const double places = std::round(after_ns / period_ns_) - 1.0;
  return static_cast<int64_t>(std::clamp(places, 0.0, static_cast<double>(kRestartFrames + 1)));
}

/// Counts one that is late, unless it begins another count.
bool LivePolicy::is_late(const LivePose& pose) {
  const bool is_far =
      (pose.frame && last_frame_ &&
       static_cast<int32_t>(*pose.frame - *last_frame_) < -static_cast<int32_t>(kRestartFrames)) ||
      (!pose.frame && pose.source_time_ns && last_source_ns_ &&
       static_cast<double>(*pose.source_time_ns) - static_cast<double>(*last_source_ns_) <
           -static_cast<double>(kClockJumpNs));
  if (is_far || ++late_in_a_row_ >= kRestartPoses) {
    forget_order();
    return false;
  }
  ++counters_.late;
  return true;
}

void LivePolicy::order(const LivePose& pose, int64_t arrival_ns) {
  const std::optional<int64_t> ahead = places_ahead(pose);
  if (ahead && *ahead < 0 && is_late(pose)) return;
  if (!ahead || *ahead <= 0 || *ahead > kRestartFrames) {
    release(pose, arrival_ns);
    const size_t waited = waiting_.size();
    release_ready();
    counters_.resequenced += waited - waiting_.size();
    return;
  }
  insert(pose, arrival_ns);
  if (waiting_.size() > kResequenceFrames) release_first();
}

void LivePolicy::insert(const LivePose& pose, int64_t arrival_ns) {
  const auto comes_before = [](const LivePose& a, const LivePose& b) {
    if (a.frame && b.frame) return static_cast<int32_t>(*a.frame - *b.frame) < 0;
    return a.source_time_ns.value_or(0) < b.source_time_ns.value_or(0);
  };
  auto place = waiting_.begin();
  while (place != waiting_.end() && comes_before(place->pose, pose)) ++place;
  if (place != waiting_.end() && !comes_before(pose, place->pose)) {
    ++counters_.late;  // twice
    return;
  }
  waiting_.insert(place, {pose, arrival_ns});
}

/// Those that waited for what has just come.
void LivePolicy::release_ready() {
  while (!waiting_.empty() && places_ahead(waiting_.front().pose).value_or(0) <= 0) {
    const Waiting next = std::move(waiting_.front());
    waiting_.pop_front();
    release(next.pose, next.arrival_ns);
  }
}

/// The first that waits goes on without those that it waited for.
void LivePolicy::release_first() {
  const Waiting next = std::move(waiting_.front());
  waiting_.pop_front();
  counters_.lost += static_cast<uint64_t>(std::max<int64_t>(places_ahead(next.pose).value_or(0), 0));
  release(next.pose, next.arrival_ns);
  release_ready();
}

/// Learns by which steps numbers or times go on.
void LivePolicy::note_order(const LivePose& pose) {
  late_in_a_row_ = 0;
  if (pose.frame && last_frame_) {
    const auto gap = static_cast<int64_t>(static_cast<int32_t>(*pose.frame - *last_frame_));
    equal_gaps_ = gap == last_gap_ ? equal_gaps_ + 1 : 0;
    last_gap_ = gap;
    if (gap > 0 && (gap < stride_ || equal_gaps_ >= kSteadyCount)) stride_ = gap;
  }
  if (pose.source_time_ns && last_source_ns_) {
    const double gap_ns = static_cast<double>(*pose.source_time_ns) - static_cast<double>(*last_source_ns_);
    const bool is_steady = std::abs(gap_ns - period_ns_) <= kSteadyShare * period_ns_;
    // A gap of a steady source says nothing of its period.
    if (is_steady || steady_periods_ < kSteadyCount) period_ns_ = gap_ns;
    // Counted no further than that another rate becomes the habit as fast.
    steady_periods_ = is_steady                        ? std::min(steady_periods_ + 1, 2 * kSteadyCount)
                      : steady_periods_ < kSteadyCount ? 0
                                                       : steady_periods_ - 1;
  }
  last_frame_ = pose.frame;
  last_source_ns_ = pose.source_time_ns;
}

// ---- what is believed

/// A pose in its order.
void LivePolicy::release(const LivePose& pose, int64_t arrival_ns) {
  note_order(pose);
  const int64_t time_ns = time_of(pose, arrival_ns);
  const bool is_taken = is_believed(pose, arrival_ns);
  came_ns_ = arrival_ns;
  if (!is_taken) {
    ++counters_.gated;
    return;
  }
  Pose seen = pose.world_from_subject;
  if (seen_ && glm::dot(seen.rotation, seen_->rotation) < 0.0) seen.rotation = -seen.rotation;
  seen_ = seen;
  seen_ns_ = arrival_ns;
  LiveHead head;
  head.time_ns = time_ns;
  head.world_from_head = head_of(pose);
  head.timecode = pose.timecode;
  add_joints(pose, head);
  if (last_ && jumps_) {
    // Hair is carried through what the hub takes for a jump.
    LiveHead before = *last_;
    before.time_ns = std::max(time_ns - kBetweenJumpsNs, last_->time_ns + kShortestStepNs);
    head.time_ns = std::max(time_ns, before.time_ns + kShortestStepNs);
    due_.push_back(before);
    last_.reset();
    ease_.reset();
    has_doubted_ = false;
  }
  // A loss is eased by the hub.
  if (last_ && std::exchange(has_doubted_, false)) begin_ease(head.world_from_head, head.time_ns);
  if (last_) head.world_from_head = clamped(eased(head.world_from_head, head.time_ns), head.time_ns);
  jumps_ = false;
  put(std::move(head));
}

bool LivePolicy::is_near(const LivePose& pose, const Pose& other, double most_m, double most_turn_rad) const {
  const Pose& seen = pose.world_from_subject;
  const bool has_place = !turns_only_ && pose.has_position;
  return (!has_place || glm::distance(seen.position_m, other.position_m) <= most_m) &&
         angle_between_rad(seen.rotation, other.rotation) <= most_turn_rad;
}

/// False while a body that is elsewhere at once, or turned elsewhere, has not stayed so.
bool LivePolicy::is_believed(const LivePose& pose, int64_t arrival_ns) {
  constexpr double kAnyTurnRad = 4.0;  // there is none beyond half a turn
  const double passed_s = static_cast<double>(arrival_ns - came_ns_) * kSPerNs;
  const bool is_zero = is_of_zeros(pose.world_from_subject) || is_lost_;
  const double most_turn_rad = is_zero ? kZerosTurnRad : std::max(kGateTurnRad, kGateTurnRadPerS * passed_s);
  if (!seen_ || jumps_ || is_near(pose, *seen_, is_zero ? kZerosJumpM : kGateJumpM, most_turn_rad)) {
    doubted_.reset();
    is_lost_ = is_lost_ && is_of_zeros(pose.world_from_subject);
    return true;
  }
  const bool is_elsewhere = !is_near(pose, *seen_, kGateJumpM, kAnyTurnRad);
  if (!is_stale(arrival_ns)) {
    if (!doubted_ || !is_near(pose, *doubted_, kGateJumpM, kGateTurnRad)) {
      doubted_since_ns_ = arrival_ns;
      doubted_poses_ = 0;
    }
    doubted_ = pose.world_from_subject;
    if (++doubted_poses_ < kGatePoses || arrival_ns - doubted_since_ns_ < kGateNs) return false;
    doubted_.reset();
    has_doubted_ = true;
    is_lost_ = is_of_zeros(pose.world_from_subject);
  }
  if (!is_elsewhere) return true;
  jumps_ = true;
  notes_.push_back(fmt::format("the head is {:.2f} m from where it was: hair is carried along, as over a cut",
                               glm::distance(pose.world_from_subject.position_m, seen_->position_m)));
  return true;
}

/// The head begins to go from where it is to where it is seen.
void LivePolicy::begin_ease(const Pose& target, int64_t time_ns) {
  const Pose& from = last_->world_from_head;
  ease_ = Ease{time_ns, from.position_m - target.position_m, turn_between(target.rotation, from.rotation)};
}

Pose LivePolicy::eased(Pose target, int64_t time_ns) {
  if (!ease_) return target;
  const double passed = static_cast<double>(time_ns - ease_->begin_ns) / static_cast<double>(kEaseNs);
  if (passed >= 1.0) {
    ease_.reset();
    return target;
  }
  const double left = 1.0 - eased_share(passed);
  target.position_m += ease_->place_m * left;
  target.rotation = turned(target.rotation, ease_->turn_rad * left);
  return target;
}

/// On the server's clock, after what was given out before.
int64_t LivePolicy::time_of(const LivePose& pose, int64_t arrival_ns) {
  int64_t time_ns = arrival_ns;
  const bool has_time = pose.source_time_ns && std::abs(*pose.source_time_ns) <= kMaxSampleTimeNs;
  if (has_time) {
    clock_.add(*pose.source_time_ns, arrival_ns);
    time_ns = std::min(*pose.source_time_ns + clock_.offset_ns(), arrival_ns);
    if (arrival_ns - time_ns <= kLateNs) timely_ns_ = arrival_ns;
    // The source's clock was set, or stood still while its poses did: a new mapping.
    if (arrival_ns - time_ns > kClockJumpNs || arrival_ns - timely_ns_ > kLateForNs) {
      timely_ns_ = arrival_ns;
      clock_ = {};
      clock_.add(*pose.source_time_ns, arrival_ns);
      time_ns = arrival_ns;
    }
  }
  if (last_ && time_ns <= last_->time_ns) time_ns = std::max(arrival_ns, last_->time_ns + kShortestStepNs);
  return time_ns;
}

Pose LivePolicy::head_of(const LivePose& pose) const {
  Pose head = pose.world_from_subject;
  if (calibration_) {
    head.rotation = glm::normalize(calibration_->from_stage * head.rotation * calibration_->from_mount);
    head.position_m = calibration_->from_stage * (head.position_m - calibration_->origin_m);
  }
  if (turns_only_ || !pose.has_position) head.position_m = glm::dvec3(0.0);
  return head;
}

/// Joints are told in the world of the source, and belong to the head.
void LivePolicy::add_joints(const LivePose& pose, LiveHead& head) const {
  if (pose.joint_m.size() != pose.joint_names.size()) return;
  glm::dquat rotation = pose.world_from_subject.rotation;
  if (calibration_) rotation = rotation * calibration_->from_mount;
  const glm::dquat head_from_world = glm::conjugate(rotation);
  for (size_t i = 0; i < pose.joint_m.size() && head.joint_m.size() < kMaxMotionJoints; ++i) {
    const std::string& name = pose.joint_names[i];
    const glm::dvec3 place_m = head_from_world * (pose.joint_m[i] - pose.world_from_subject.position_m);
    const bool is_new =
        std::find(head.joint_names.begin(), head.joint_names.end(), name) == head.joint_names.end();
    // The negation is true for what is no number.
    if (name.empty() || name.size() > kMaxJointNameBytes || !is_new ||
        !(glm::length(place_m) <= kMaxJointDistanceM))
      continue;
    head.joint_names.push_back(name);
    head.joint_m.emplace_back(place_m);
  }
}

// ---- what the head does

/// As far towards the target as a head gets by then: after a gap the whole time counts.
Pose LivePolicy::clamped(const Pose& target, int64_t time_ns) {
  const Pose& from = last_->world_from_head;
  const double passed_s = static_cast<double>(time_ns - last_->time_ns) * kSPerNs;
  const double window_s = std::max(static_cast<double>(kClampWindowNs) * kSPerNs, passed_s);
  move_allowance_m_ = std::min(move_allowance_m_ + kMaxLiveSpeedMps * passed_s, kMaxLiveSpeedMps * window_s);
  turn_allowance_rad_ =
      std::min(turn_allowance_rad_ + kMaxLiveTurnRadPerS * passed_s, kMaxLiveTurnRadPerS * window_s);
  Pose reached = target;
  const double way_m = glm::distance(from.position_m, target.position_m);
  const double turn_rad = angle_between_rad(from.rotation, target.rotation);
  const bool is_too_far = way_m > move_allowance_m_;
  const bool is_too_turned = turn_rad > turn_allowance_rad_;
  if (is_too_far)
    reached.position_m = glm::mix(from.position_m, target.position_m, move_allowance_m_ / way_m);
  if (is_too_turned) reached.rotation = interpolate(from, target, turn_allowance_rad_ / turn_rad).rotation;
  if (is_too_far || is_too_turned) ++counters_.clamped;
  move_allowance_m_ -= std::min(way_m, move_allowance_m_);
  turn_allowance_rad_ -= std::min(turn_rad, turn_allowance_rad_);
  return reached;
}

void LivePolicy::put(LiveHead head) {
  if (last_ && glm::dot(head.world_from_head.rotation, last_->world_from_head.rotation) < 0.0)
    head.world_from_head.rotation = -head.world_from_head.rotation;
  last_ = head;
  due_.push_back(std::move(head));
}

}  // namespace strandcast
