#include "server/input/input_hub.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/units.h"
#include "common/log/log.h"

namespace strandcast {
namespace {

bool is_possible(const glm::dvec3& wind_mps) {
  // Also false for NaN, which compares false.
  return glm::length(wind_mps) <= kMaxWindStreamMps;
}

/// True when going from a to b in `duration_s` is faster than any head.
bool is_teleport(const Pose& a, const Pose& b, double duration_s) {
  return glm::distance(a.position_m, b.position_m) > kTeleportSpeedMps * duration_s ||
         angle_between_rad(a.rotation, b.rotation) > kTeleportTurnRadPerS * duration_s;
}

bool is_teleport(const TimedSample<HeadSample>& a, const TimedSample<HeadSample>& b) {
  const double apart_s = static_cast<double>(b.time_ns - a.time_ns) * kSPerNs;
  return is_teleport(a.value.pose, b.value.pose, std::max(apart_s, kTeleportShortestS));
}

/// How far `time_ns` lies from one sample to the next, 0..1; it is not before the first.
template <class Sample>
double blend_at(const Sample& before, const Sample& after, int64_t time_ns) {
  const double whole = static_cast<double>(after.time_ns - before.time_ns);
  return std::clamp(static_cast<double>(time_ns - before.time_ns) / whole, 0.0, 1.0);
}

/// The timecode on the way from one sample to the next, or the first one's where one does not go on into the
/// other.
std::optional<Timecode> timecode_between(const TimedSample<HeadSample>& a, const TimedSample<HeadSample>& b,
                                         double blend) {
  const auto &from = a.value.timecode, &to = b.value.timecode;
  if (!from || !to || !is_same_count(*from, *to)) return from;
  const double frames = frames_between(*from, *to);
  const double passed_s = static_cast<double>(b.time_ns - a.time_ns) * kSPerNs;
  const bool goes_on = std::abs(frames / from->rate.hz() - passed_s) <= kTimecodeJumpS;
  return goes_on ? advanced(*from, blend * frames) : *from;
}

JointPlaces joints_of(const HeadSample& sample) {
  JointPlaces joints;
  if (sample.joint_m.empty()) return joints;
  joints.name = *sample.joint_names;
  joints.place_m.assign(sample.joint_m.begin(), sample.joint_m.end());
  return joints;
}

/// A moving mean to which a gap counts as twice the usual; 0 before the first.
void add_to_usual(double& usual_ns, int64_t newest_ns) {
  constexpr double kShare = 0.125;
  const auto newest = static_cast<double>(newest_ns);
  usual_ns = usual_ns == 0.0 ? newest : usual_ns + kShare * (std::min(newest, 2.0 * usual_ns) - usual_ns);
}

/// A time that cannot overflow when the offset is taken from it.
int64_t bounded(int64_t time_ns) {
  return std::clamp(time_ns, -kMaxSampleTimeNs, kMaxSampleTimeNs);
}

}  // namespace

template <class Value>
bool InputHub::take_allowance(Stream<Value>& stream, uint64_t source_id, int64_t arrival_ns) {
  auto found = stream.allowances.find(source_id);
  if (found == stream.allowances.end()) {
    if (stream.allowances.size() >= kMaxInputSources) return false;
    found = stream.allowances.emplace(source_id, Allowance{kMaxSampleBurst, arrival_ns}).first;
  }
  Allowance& allowance = found->second;
  const double gained = static_cast<double>(arrival_ns - allowance.updated_ns) * kSPerNs * kMaxSampleRateHz;
  allowance.samples = std::min(kMaxSampleBurst, allowance.samples + gained);
  allowance.updated_ns = arrival_ns;
  if (allowance.samples < 1.0) return false;
  allowance.samples -= 1.0;
  return true;
}

/// What comes next follows nothing that came before.
template <class Value>
void InputHub::restart(Stream<Value>& stream) {
  stream.clock = {};
  stream.track.clear();
  stream.is_cut = true;
  stream.usual_spacing_ns = stream.usual_wait_ns = 0.0;
}

/// How far the newest sample is from the one before it.
template <class Value>
void InputHub::note_spacing(Stream<Value>& stream) {
  constexpr int64_t kAtOnceNs = 2'000'000;
  const auto& samples = stream.track.samples();
  if (samples.size() < 2) return;
  const auto &newest = samples.back(), &before = samples[samples.size() - 2];
  add_to_usual(stream.usual_spacing_ns, newest.time_ns - before.time_ns);
  if (newest.arrival_ns - before.arrival_ns > kAtOnceNs)
    add_to_usual(stream.usual_wait_ns, newest.arrival_ns - before.arrival_ns);
}

template <class Value>
void InputHub::accept(Stream<Value>& stream, uint64_t source_id, const TimedSample<Value>& sample,
                      int64_t stale_ns) {
  if (stream.owner != source_id) {
    if (stream.owner && sample.arrival_ns - stream.accepted_ns <= stale_ns) {
      ++counters_.not_owner;
      const uint64_t owner = *stream.owner;
      tell_refusal(source_id,
                   fmt::format("{} sends, and one at a time is heard",
                               owner < kFirstLiveSourceId
                                   ? fmt::format("source {}", owner)
                                   : fmt::format("live input {}", owner - kFirstLiveSourceId + 1)));
      return;
    }
    stream.owner = source_id;
    restart(stream);
  }
  // A step of the source's clock: late samples would be refused for ever, or the mapping would be off by the
  // step.
  if (!stream.track.samples().empty()) {
    const auto& newest = stream.track.samples().back();
    const int64_t passed_ns = sample.arrival_ns - newest.arrival_ns;
    const int64_t stepped_ns = sample.time_ns - newest.time_ns;
    if (stepped_ns < -kClockJumpNs || stepped_ns > passed_ns + kClockJumpNs) {
      restart(stream);
      ++counters_.clock_restarts;
    }
  }
  switch (stream.track.insert(sample)) {
    case InsertOutcome::Late:
      ++counters_.late;
      return;
    case InsertOutcome::Duplicate:
      ++counters_.duplicate;
      return;
    case InsertOutcome::Accepted:
      break;
  }
  note_spacing(stream);
  stream.clock.add(sample.time_ns, sample.arrival_ns);
  stream.accepted_ns = sample.arrival_ns;
  ++counters_.accepted;
}

void InputHub::hold_samples() {
  const std::lock_guard lock(mutex_);
  held_.emplace();
}

std::string InputHub::push(uint64_t source_id, const MotionSamples& samples, int64_t arrival_ns) {
  const std::lock_guard lock(mutex_);
  if (held_)
    counters_.over_rate += held_->hold(source_id, samples, last_frame_ns_.value_or(0));
  else
    take(source_id, samples, arrival_ns);
  return std::exchange(refusal_, {});
}

void InputHub::push(const Timecode& timecode, int64_t arrival_ns) {
  const std::lock_guard lock(mutex_);
  newest_arrival_ns_ = std::max(newest_arrival_ns_, bounded(arrival_ns));
  if (!held_) timecodes_.add(timecode, newest_arrival_ns_);
}

std::string InputHub::push(uint64_t source_id, const WindSamples& samples, int64_t arrival_ns) {
  const std::lock_guard lock(mutex_);
  if (held_)
    counters_.over_rate += held_->hold(source_id, samples, last_frame_ns_.value_or(0));
  else
    take(source_id, samples, arrival_ns);
  return std::exchange(refusal_, {});
}

/// Of each source, once.
void InputHub::tell_refusal(uint64_t source_id, const std::string& why) {
  if (told_refusals_.size() >= kMaxInputSources || !told_refusals_.insert(source_id).second) return;
  refusal_ = kRefusedSamples + why;
  log_warn("input", "samples of source {} are left out: {}", source_id, why);
}

/// mutex_ is held.
void InputHub::take(uint64_t source_id, const MotionSamples& samples, int64_t arrival_ns) {
  newest_arrival_ns_ = std::max(newest_arrival_ns_, bounded(arrival_ns));
  const auto names = samples.joint_names.empty()
                         ? nullptr
                         : std::make_shared<const std::vector<std::string>>(samples.joint_names);
  if (samples.timecode && samples.samples.empty()) timecodes_.add(*samples.timecode, newest_arrival_ns_);
  for (const MotionSamples::Sample& sample : samples.samples) {
    if (!take_allowance(motion_, source_id, newest_arrival_ns_)) {
      ++counters_.over_rate;
    } else if (std::string why = refusal_of(sample, samples.joint_names.size()); !why.empty()) {
      ++counters_.impossible;
      tell_refusal(source_id, why);
    } else if (bounded(sample.time_ns) != sample.time_ns) {
      ++counters_.impossible;
    } else {
      Pose pose = sample.world_from_head;
      pose.rotation = glm::normalize(pose.rotation);
      accept(motion_, source_id,
             {sample.time_ns, newest_arrival_ns_,
              HeadSample{pose, names, sample.joint_m, timecode_of(samples, sample)}},
             kMotionStaleNs);
    }
  }
  if (motion_.owner == source_id) motion_speed_ = 1.0 - std::clamp(samples.held_back, 0.0, 1.0);
}

/// mutex_ is held.
void InputHub::take(uint64_t source_id, const WindSamples& samples, int64_t arrival_ns) {
  newest_arrival_ns_ = std::max(newest_arrival_ns_, bounded(arrival_ns));
  for (const WindSamples::Sample& sample : samples.samples) {
    const glm::dvec3 velocity_mps = sample.velocity_mps;
    if (!take_allowance(wind_, source_id, newest_arrival_ns_))
      ++counters_.over_rate;
    else if (!is_possible(velocity_mps) || bounded(sample.time_ns) != sample.time_ns)
      ++counters_.impossible;
    else
      accept(wind_, source_id, {sample.time_ns, newest_arrival_ns_, velocity_mps}, kWindStaleNs);
  }
}

void InputHub::set_delay(uint64_t source_id, int64_t delay_ns) {
  const std::lock_guard lock(mutex_);
  delays_ns_.erase(source_id);
  if (delay_ns > 0) delays_ns_.emplace(source_id, delay_ns);
}

template <class Value>
void InputHub::forget(Stream<Value>& stream, uint64_t source_id) {
  stream.allowances.erase(source_id);
  if (stream.owner != source_id) return;
  stream.owner.reset();
  stream.track.clear();
  stream.clock = {};
}

void InputHub::remove_source(uint64_t source_id) {
  const std::lock_guard lock(mutex_);
  if (held_) return held_->leave(source_id);
  forget(source_id);
}

void InputHub::forget(uint64_t source_id) {
  const auto& samples = motion_.track.samples();
  if (motion_.owner == source_id) {
    has_left_ = true;
    if (!samples.empty() && (motion_.is_cut || !shown_ns_ || samples.back().time_ns > *shown_ns_))
      unseen_ = samples.back().value;
  }
  forget(motion_, source_id);
  forget(wind_, source_id);
  told_refusals_.erase(source_id);
}

/// Where the head is at the asked time, as its source says.
InputHub::SeenHead InputHub::see_head(int64_t server_time_ns) {
  const auto& samples = motion_.track.samples();
  SeenHead seen{frame_.world_from_head};
  const std::optional<HeadSample> unseen = std::exchange(unseen_, std::nullopt);
  if (samples.empty()) {
    if (unseen) {
      seen.pose = unseen->pose;
      frame_.joints = joints_of(*unseen);
    }
    seen.is_absent = !unseen;
    return seen;
  }
  const auto delay = motion_.owner ? delays_ns_.find(*motion_.owner) : delays_ns_.end();
  const int64_t delay_ns = delay != delays_ns_.end() ? delay->second : 0;
  const int64_t asked_ns = motion_.clock.to_source_ns(server_time_ns) - delay_ns;
  seen.is_silent = is_silent(asked_ns, delay_ns);
  const int64_t time_ns = steadied_ns(asked_ns, server_time_ns);
  const size_t index = motion_.track.index_at(time_ns);
  // Everything older than the last frame's sample is gone from the track, so this looks at each pair once.
  for (size_t i = 0; i < index; ++i)
    seen.has_jumped = seen.has_jumped || is_teleport(samples[i], samples[i + 1]);

  const bool interpolates = index + 1 < samples.size() && time_ns > samples[index].time_ns &&
                            !is_teleport(samples[index], samples[index + 1]);
  const size_t newest = interpolates ? index + 1 : index;
  const HeadSample& sample = samples[index].value;
  Pose pose = sample.pose;
  frame_.joints = joints_of(sample);
  frame_.timecode = sample.timecode;
  if (interpolates) {
    const HeadSample& next = samples[newest].value;
    const double blend = blend_at(samples[index], samples[newest], time_ns);
    pose = interpolate(pose, next.pose, blend);
    frame_.timecode = timecode_between(samples[index], samples[newest], blend);
    const bool is_same_body =
        !sample.joint_m.empty() && !next.joint_m.empty() &&
        (sample.joint_names == next.joint_names || *sample.joint_names == *next.joint_names);
    for (size_t i = 0; is_same_body && i < frame_.joints.place_m.size(); ++i)
      frame_.joints.place_m[i] = glm::mix(frame_.joints.place_m[i], glm::dvec3(next.joint_m[i]), blend);
  }
  // Both signs are the same rotation; consecutive frames keep to one so that their difference is small.
  if (glm::dot(pose.rotation, frame_.world_from_head.rotation) < 0.0) pose.rotation = -pose.rotation;
  seen.pose = pose;
  seen.time_ns = interpolates ? time_ns : samples[index].time_ns;
  seen.has_caught_up = has_caught_up(seen.time_ns, server_time_ns);
  seen.has_jumped = std::exchange(motion_.is_cut, false) || seen.has_jumped;
  frame_.motion_time_ns = samples[newest].arrival_ns;
  note_used(samples[newest].arrival_ns, samples[newest].time_ns + motion_.clock.offset_ns());
  motion_.track.use(index, newest);
  return seen;
}

/// Returns whether the newest sample of an evenly shown source is later than usual. Samples of other
/// sources are held until the next.
bool InputHub::is_silent(int64_t time_ns, int64_t delay_ns) const {
  const double usual_ns = std::max(motion_.usual_spacing_ns, motion_.usual_wait_ns);
  const bool is_even = kMostSteadiedSpacings * usual_ns <= static_cast<double>(kMostSteadiedNs) ||
                       usual_ns <= static_cast<double>(delay_ns);
  const auto late_ns = static_cast<double>(time_ns - motion_.track.samples().back().time_ns);
  return usual_ns > 0.0 && is_even && late_ns > steady_delay_ns_ + kUnseenLateNs;
}

/// The time to show: as late behind `time_ns` as samples have been of late. A steady source is as late in
/// each frame, so it is held as its newest sample and waits for nothing.
int64_t InputHub::steadied_ns(int64_t time_ns, int64_t server_time_ns) {
  if (motion_.is_cut) steady_delay_ns_ = 0.0;
  const double passed_ns =
      last_frame_ns_ ? static_cast<double>(std::max<int64_t>(server_time_ns - *last_frame_ns_, 0)) : 0.0;
  const double usual_ns = std::max(motion_.usual_spacing_ns, motion_.usual_wait_ns);
  const double most_ns = kMostSteadiedSpacings * usual_ns;
  if (most_ns > static_cast<double>(kMostSteadiedNs)) return time_ns;
  steady_delay_ns_ = std::max(0.0, steady_delay_ns_ - kSteadyShrink * passed_ns);
  const auto late_ns = static_cast<double>(time_ns - motion_.track.samples().back().time_ns);
  if (late_ns > kUnseenLateNs && late_ns <= most_ns) steady_delay_ns_ = std::max(steady_delay_ns_, late_ns);
  return time_ns - static_cast<int64_t>(steady_delay_ns_);
}

/// True when the frame shows motion of a longer time than passed since the last one.
bool InputHub::has_caught_up(int64_t shown_ns, int64_t server_time_ns) {
  const std::optional<int64_t> before_ns = std::exchange(shown_ns_, shown_ns);
  if (!before_ns || !last_frame_ns_) return false;
  const double beyond_ns =
      static_cast<double>(shown_ns - *before_ns) - static_cast<double>(server_time_ns - *last_frame_ns_);
  const double usual_ns = std::max(motion_.usual_spacing_ns, motion_.usual_wait_ns);
  return beyond_ns > std::max(static_cast<double>(kCatchUpNs), kCatchUpSpacings * usual_ns);
}

void InputHub::note_used(int64_t arrival_ns, int64_t made_ns) {
  if (!used_samples_.empty() && used_samples_.back().arrival_ns == arrival_ns) {
    used_samples_.back().made_ns = made_ns;
    return;
  }
  used_samples_.push_back({arrival_ns, made_ns});
  if (used_samples_.size() > kKeptSourceTimes) used_samples_.pop_front();
}

int64_t InputHub::source_time_ns(int64_t arrival_ns) const {
  const std::lock_guard lock(mutex_);
  const auto found = std::find_if(used_samples_.rbegin(), used_samples_.rend(),
                                  [&](const UsedSample& used) { return used.arrival_ns == arrival_ns; });
  return found != used_samples_.rend() ? found->made_ns : 0;
}

/// Moves the frame's head to where it is seen, or eases it there. Strands are carried through a jump.
void InputHub::show_head(const SeenHead& seen, int64_t server_time_ns) {
  const double passed_s =
      last_frame_ns_ ? static_cast<double>(server_time_ns - *last_frame_ns_) * kSPerNs : kTeleportShortestS;
  const double travel_s = std::clamp(passed_s, kTeleportShortestS, kTeleportLongestS);
  Pose& head = frame_.world_from_head;
  const bool is_absent = seen.is_absent && easing_.knows_speed();
  const bool is_silent = (seen.is_silent && easing_.knows_speed()) || is_absent;
  const bool has_jumped = seen.has_jumped || (!is_silent && is_teleport(head, seen.pose, travel_s));
  double since_s = static_cast<double>(seen.time_ns - heard_ns_) * kSPerNs;
  // Another source has a clock of its own.
  if (absent_s_ > 0.0) since_s = std::max(absent_s_, kShortestEasingS);
  absent_s_ = is_absent ? absent_s_ + std::max(passed_s, 0.0) : 0.0;
  if (has_jumped)
    easing_.restart(head = seen.pose);
  else if (is_absent)
    head = easing_.hold(std::clamp(passed_s, 0.0, kTeleportLongestS));
  else if (is_silent)
    head = easing_.coast(std::clamp(passed_s, 0.0, kTeleportLongestS));
  else
    head = easing_.follow(seen.pose, std::max(since_s, kTeleportShortestS), std::max(passed_s, 0.0));
  if (!refusal_of(head).empty()) easing_.restart(head = seen.pose);  // at the edge of the world
  if (has_jumped || !is_silent) {
    heard_ns_ = seen.time_ns;
    heard_timecode_ = frame_.timecode;
  }
  // A head that coasts, or eases back, shows another time than its source says.
  if (heard_timecode_)
    frame_.timecode = advanced(*heard_timecode_, easing_.ahead_s() * heard_timecode_->rate.hz());
  frame_.has_teleported = has_jumped || seen.has_caught_up;
  if (frame_.has_teleported) ++counters_.teleports;
}

/// What is due by now, and of sources that have left the last there was.
void InputHub::take_held(int64_t time_ns) {
  for (const HeldInputs::Due& due : held_->take_due(time_ns)) {
    if (due.motion) take(due.source_id, *due.motion, due.arrival_ns);
    if (due.wind) take(due.source_id, *due.wind, due.arrival_ns);
  }
  for (const uint64_t source_id : held_->take_left()) forget(source_id);
}

InputFrame InputHub::sample(int64_t server_time_ns) {
  const std::lock_guard lock(mutex_);
  const int64_t now_ns = bounded(server_time_ns);
  if (held_) take_held(now_ns);
  // The first pose replaces none: strands must not be dragged there from the origin.
  const bool is_first = !frame_.has_motion && (unseen_ || !motion_.track.samples().empty());
  SeenHead seen = see_head(now_ns);
  const bool has_left = std::exchange(has_left_, false);
  seen.has_jumped = seen.has_jumped || is_first || has_left;
  frame_.has_motion = frame_.has_motion || is_first;
  frame_.motion_speed = motion_speed_;
  show_head(seen, now_ns);
  frame_.is_motion_stale = !motion_.owner || now_ns - motion_.accepted_ns > kMotionStaleNs;
  if (frame_.is_motion_stale || !frame_.timecode) frame_.timecode = timecodes_.at(now_ns);

  const auto& winds = wind_.track.samples();
  frame_.has_wind_stream = !winds.empty() && now_ns - wind_.accepted_ns <= kWindStaleNs;
  if (frame_.has_wind_stream) {
    const int64_t time_ns = wind_.clock.to_source_ns(now_ns);
    const size_t index = wind_.track.index_at(time_ns);
    const bool interpolates = index + 1 < winds.size() && time_ns > winds[index].time_ns;
    const size_t newest = interpolates ? index + 1 : index;
    const double blend = interpolates ? blend_at(winds[index], winds[newest], time_ns) : 0.0;
    frame_.wind_mps = glm::mix(winds[index].value, winds[newest].value, blend);
    wind_.track.use(index, newest);
  } else {
    frame_.wind_mps = glm::vec3(0.0f);
  }
  frame_.rejected_samples = counters_.rejected();
  last_frame_ns_ = now_ns;
  return frame_;
}

InputCounters InputHub::counters() const {
  const std::lock_guard lock(mutex_);
  InputCounters counters = counters_;
  counters.dropped_oldest = motion_.track.dropped() + wind_.track.dropped();
  return counters;
}

}  // namespace strandcast
