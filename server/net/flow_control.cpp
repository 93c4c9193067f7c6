#include "server/net/flow_control.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/quantile.h"

namespace strandcast {
namespace {

constexpr double kNsPerS = 1e9;
/// Round trips shorter than this differ by scheduling, not by the link.
constexpr int64_t kLeastTransferNs = kNsPerMs;
constexpr size_t kMaxBusySamples = 16;
/// A rate is taken over at least this: frames and acknowledgements come in bunches.
constexpr int64_t kBusySpanNs = 50 * kNsPerMs;
/// A round trip differs by so much for other reasons than the rate: jitter, or a client that looks only now
/// and then.
constexpr int64_t kJitterNs = 50 * kNsPerMs;
constexpr size_t kMinBusySamples = 3;
constexpr int64_t kBusyAgeNs = 2'000 * kNsPerMs;
/// A change needs time to show: nothing is decided before.
constexpr int64_t kSettleNs = 500 * kNsPerMs;
constexpr double kDrainingShare = 0.95;
constexpr int64_t kKeyframeSlackNs = kGateDelayNs / 2;

/// What takes the place of many frames that build on each other.
bool is_keyframe(const FrameHeader& header) {
  return header.opcode == Opcode::StrandKeyframe ||
         (is_chained_picture(header.opcode) && header.base_sequence == 0);
}

}  // namespace

void FlowControl::on_sent(const FrameHeader& header, size_t bytes, int64_t time_ns) {
  if (!has_acks_) return;
  const bool is_asset = header.opcode == Opcode::Asset;
  in_flight_.push_back({header.stream_id, header.sequence, is_asset || is_keyframe(header), is_asset,
                        in_flight_.empty(), bytes, time_ns});
  in_flight_bytes_ += bytes;
  if (is_keyframe(header)) keyframe_ = in_flight_.back();
}

void FlowControl::on_written(const FrameHeader& header, int64_t time_ns) {
  // What follows is no sign of life: a kernel takes it in for a client that sleeps.
  if (!in_flight_.empty() && in_flight_.front().stream_id == header.stream_id &&
      in_flight_.front().sequence == header.sequence)
    written_ns_ = time_ns;
}

void FlowControl::on_ack(uint16_t stream_id, uint32_t sequence, int64_t time_ns) {
  const auto acked = std::find_if(in_flight_.begin(), in_flight_.end(), [&](const Frame& frame) {
    return frame.stream_id == stream_id && frame.sequence == sequence;
  });
  if (acked == in_flight_.end()) return;
  // Frames before it that were not acknowledged could not be used; they have arrived all the same.
  const Frame frame = *acked;
  for (auto skipped = in_flight_.begin(); skipped <= acked; ++skipped) in_flight_bytes_ -= skipped->bytes;
  in_flight_.erase(in_flight_.begin(), acked + 1);
  if (time_ns - bunch_ns_ >= kLeastTransferNs) {
    before_bunch_ns_ = last_ack_ns_;
    bunch_ns_ = time_ns;
  }
  take_sample(frame, time_ns);
  last_ack_ns_ = time_ns;
}

void FlowControl::take_sample(const Frame& frame, int64_t time_ns) {
  const int64_t round_trip_ns = time_ns - frame.sent_ns;
  note_capacity(frame, round_trip_ns, time_ns);
  const int64_t own_ns = transfer_ns(frame.bytes, time_ns);
  // Alone on its way a frame waits for nothing: what is left is the bare link, which may have become longer.
  const int64_t bare_ns = std::max<int64_t>(round_trip_ns - own_ns, kLeastTransferNs);
  if (frame.was_alone && !round_trips_.empty() && bare_ns > base_ns() + kHighDelayNs &&
      time_ns - static_cast<int64_t>(round_trips_.front().time_ns) > kLossWindowNs)
    round_trips_.clear();
  note_round_trip(frame.was_alone ? bare_ns : round_trip_ns, time_ns);
  queue_delay_ns_ = std::max<int64_t>(round_trip_ns - base_ns() - own_ns, 0);
  delays_.push_back({time_ns, static_cast<double>(queue_delay_ns_)});
  while (delays_.front().time_ns < time_ns - kDelayWindowNs) delays_.pop_front();
}

void FlowControl::on_round_trip(int64_t round_trip_ns, int64_t time_ns) {
  if (round_trip_ns >= 0) note_round_trip(std::max(round_trip_ns, kLeastTransferNs), time_ns);
}

/// Keeps the candidates for the minimum of the window: each newer one is longer than all before it.
void FlowControl::note_round_trip(int64_t round_trip_ns, int64_t time_ns) {
  const auto value = static_cast<double>(round_trip_ns);
  while (!round_trips_.empty() && round_trips_.back().value >= value) round_trips_.pop_back();
  round_trips_.push_back({time_ns, value});
  while (round_trips_.front().time_ns < time_ns - kBaseWindowNs) round_trips_.pop_front();
}

int64_t FlowControl::base_ns() const {
  return round_trips_.empty() ? 0 : static_cast<int64_t>(round_trips_.front().value);
}

void FlowControl::note_capacity(const Frame& frame, int64_t round_trip_ns, int64_t time_ns) {
  // A large frame that met nothing on its way shows the rate by how much longer it took than something small.
  // One that took about as long as expected shows nothing new, least of all a short one.
  if (frame.is_large && frame.was_alone && !round_trips_.empty()) {
    const int64_t duration_ns = std::max(round_trip_ns - base_ns(), kLeastTransferNs);
    const bool is_known = seen_rate_ && seen_rate_->time_ns >= time_ns - capacity_age_ns_;
    const auto bytes = static_cast<double>(frame.bytes);
    const int64_t expected_ns = is_known ? static_cast<int64_t>(bytes / seen_rate_->value * kNsPerS) : 0;
    if (!is_known || std::abs(duration_ns - expected_ns) > kJitterNs)
      seen_rate_ = {time_ns, bytes * kNsPerS / static_cast<double>(duration_ns)};
  }
  note_busy_frame(frame, time_ns);
}

/// Collects frames that should have been here when the client looked last, and were not: since then the link
/// was busy with them.
void FlowControl::note_busy_frame(const Frame& frame, int64_t time_ns) {
  const bool was_queued = before_bunch_ns_ > 0 && frame.sent_ns + base_ns() + kLowDelayNs <= before_bunch_ns_;
  if (!was_queued) {
    busy_bytes_ = 0.0;
    busy_ns_ = 0;
    return;
  }
  const int64_t since_last_ns = time_ns - last_ack_ns_;
  // Acknowledgements come in bunches; the end of one is known when the next begins.
  if (busy_ns_ >= kBusySpanNs && since_last_ns >= kLeastTransferNs) {
    busy_rates_.push_back({time_ns, std::exchange(busy_bytes_, 0.0) * kNsPerS /
                                        static_cast<double>(std::exchange(busy_ns_, 0))});
    if (busy_rates_.size() > kMaxBusySamples) busy_rates_.pop_front();
    // Remembered, so that what cannot fit is not tried again soon.
    if (const double rate = busy_bytes_per_s(time_ns); rate > 0.0) seen_rate_ = {time_ns, rate};
  }
  busy_bytes_ += static_cast<double>(frame.bytes);
  busy_ns_ += since_last_ns;
}

void FlowControl::forget_in_flight() {
  in_flight_.clear();
  in_flight_bytes_ = 0;
}

/// What the link carried while it was the limit; 0 when it has not been of late.
double FlowControl::busy_bytes_per_s(int64_t time_ns) const {
  std::vector<double> rates;
  for (const Sample& sample : busy_rates_)
    if (sample.time_ns >= time_ns - kBusyAgeNs) rates.push_back(sample.value);
  // A freeze makes one long interval and many of nearly nothing, a slow link makes all alike.
  return rates.size() >= kMinBusySamples ? median(std::move(rates)) : 0.0;
}

double FlowControl::capacity_bytes_per_s(int64_t time_ns) const {
  if (const double rate = busy_bytes_per_s(time_ns); rate > 0.0) return rate;
  const bool is_known = seen_rate_ && seen_rate_->time_ns >= time_ns - capacity_age_ns_;
  return is_known ? seen_rate_->value : 0.0;
}

void FlowControl::on_chain_loss(int64_t time_ns) {
  losses_ns_.push_back(time_ns);
  while (losses_ns_.front() < time_ns - kLossWindowNs) losses_ns_.pop_front();
}

int64_t FlowControl::transfer_ns(size_t bytes, int64_t time_ns) const {
  const double capacity = capacity_bytes_per_s(time_ns);
  return capacity > 0.0 ? static_cast<int64_t>(static_cast<double>(bytes) / capacity * kNsPerS) : 0;
}

int64_t FlowControl::oldest_due_ns(int64_t time_ns) const {
  if (in_flight_.empty()) return 0;
  const Frame& oldest = in_flight_.front();
  return std::max({oldest.sent_ns, last_ack_ns_, written_ns_}) + base_ns() +
         std::min(transfer_ns(oldest.bytes, time_ns), kLongestTransferNs);
}

/// How long frames may wait behind a keyframe that fills the gate by itself, while its queue drains: they
/// would be held for being late otherwise, and the next keyframe would be due already.
int64_t FlowControl::keyframe_allowance_ns(int64_t time_ns) const {
  if (!keyframe_) return 0;
  const int64_t own_ns = transfer_ns(keyframe_->bytes, time_ns);
  const int64_t draining_ns = std::max<int64_t>(time_ns - keyframe_->sent_ns - own_ns, 0);
  if (draining_ns >= kDrainNs) return 0;
  const double left = 1.0 - static_cast<double>(draining_ns) / static_cast<double>(kDrainNs);
  return static_cast<int64_t>(left * static_cast<double>(std::min(own_ns, kDrainNs) + kKeyframeSlackNs));
}

/// How long a frame sent now waits until the link is free, by what is on its way; 0 while the capacity is
/// unknown.
int64_t FlowControl::expected_wait_ns(int64_t time_ns) const {
  const double capacity = capacity_bytes_per_s(time_ns);
  if (capacity <= 0.0) return 0;
  // The last one acknowledged left the link half a bare round trip after it was its turn and half of one ago.
  int64_t free_ns = last_ack_ns_ - base_ns();
  for (const Frame& frame : in_flight_)
    free_ns = std::max(free_ns, frame.sent_ns) +
              static_cast<int64_t>(static_cast<double>(frame.bytes) / capacity * kNsPerS);
  return std::max<int64_t>(free_ns - time_ns, 0);
}

bool FlowControl::may_start(int64_t time_ns) const {
  return may_send(time_ns) && (!has_acks_ || expected_wait_ns(time_ns) <= kStartDelayNs);
}

bool FlowControl::may_send(int64_t time_ns) const {
  if (!has_acks_ || in_flight_.empty()) return true;
  if (in_flight_bytes_ >= kMaxInFlightBytes || in_flight_.size() >= kMaxInFlightFrames) return false;
  const Frame& oldest = in_flight_.front();
  // What the link can do shows when the asset or the first picture has arrived; all else waits for that.
  if (oldest.is_asset || (last_ack_ns_ == 0 && in_flight_bytes_ >= kFirstBytes)) return false;
  // Acknowledgements may get lost with a client's queue: it is asked again, slowly, and never given up here.
  if (time_ns - in_flight_.back().sent_ns >= kAskAgainNs) return true;
  const int64_t allowance_ns = keyframe_allowance_ns(time_ns);
  if (expected_wait_ns(time_ns) > std::max(kGateQueueNs, allowance_ns)) return false;
  // Behind a keyframe may follow what is cheaper than another keyframe would be.
  if (oldest.is_large && in_flight_bytes_ <= 2 * oldest.bytes) return true;
  if (in_flight_.size() < kFreeFrames) return true;
  // A try fills the queue for a round trip before that shows.
  const int64_t gate_ns = is_trying(time_ns) ? kStartDelayNs : kGateDelayNs;
  return time_ns - oldest.sent_ns <=
         base_ns() + transfer_ns(oldest.bytes, time_ns) + std::max(gate_ns, allowance_ns);
}

/// One loss is no trouble: quick hair takes more than the class usually does, for a moment.
bool FlowControl::is_troubled(int64_t time_ns) const {
  const auto recent_losses =
      static_cast<size_t>(std::count_if(losses_ns_.begin(), losses_ns_.end(), [&](int64_t lost_ns) {
        return lost_ns > std::max(quiet_since_ns_, time_ns - kLossWindowNs);
      }));
  if (recent_losses >= kTroublingLosses) return true;
  size_t high = 0, all = 0;
  for (const Sample& sample : delays_) {
    if (sample.time_ns <= quiet_since_ns_) continue;
    ++all;
    high += sample.value > static_cast<double>(kHighDelayNs) ? 1 : 0;
  }
  // A queue that drains is no trouble: a keyframe left it behind.
  return all >= kMinDelaySamples && high == all &&
         delays_.back().time_ns - delays_.front().time_ns >= kDelayWindowNs * 3 / 4 &&
         delays_.back().value > kDrainingShare * delays_.front().value;
}

size_t FlowControl::class_below(size_t present, std::span<const double> costs, double allowed) const {
  size_t chosen = std::min(present + 1, costs.size() - 1);
  while (allowed > 0.0 && chosen + 1 < costs.size() && costs[chosen] > allowed) ++chosen;
  return chosen;
}

void FlowControl::change(size_t from, size_t to, int64_t time_ns) {
  const bool has_failed = to > from && improved_ns_ != 0 && time_ns - improved_ns_ < kProbationNs;
  if (has_failed) {
    probe_ns_ = std::min(2 * probe_ns_, kLongestProbeNs);
    failed_class_ = from;
  }
  // What has lasted no longer counts as failed.
  const bool has_lasted = improved_ns_ != 0 && time_ns - improved_ns_ > 2 * kProbationNs;
  if (has_lasted && from <= failed_class_) probe_ns_ = kFirstProbeNs;
  if (to < from) improved_ns_ = time_ns;
  if (to > from) improved_ns_ = 0;
  quiet_since_ns_ = time_ns;
}

/// A better class was tried and did not get through even once: nothing is gained by waiting.
bool FlowControl::has_failed_try(int64_t time_ns) const {
  return is_trying(time_ns) && !losses_ns_.empty() && losses_ns_.back() > improved_ns_;
}

bool FlowControl::is_trying(int64_t time_ns) const {
  return improved_ns_ != 0 && time_ns - improved_ns_ < kProbationNs;
}

/// Keeps the candidates for the maximum of the window: each newer one is lower than all before it.
void FlowControl::note_demand(double cost, int64_t time_ns) {
  while (!demands_.empty() && demands_.back().value <= cost) demands_.pop_back();
  demands_.push_back({time_ns, cost});
  while (demands_.front().time_ns < time_ns - kDemandWindowNs) demands_.pop_front();
}

/// Frames usually wait; that a client looks for them only now and then does not count.
bool FlowControl::has_standing_delay() const {
  std::vector<double> delays;
  for (const Sample& sample : delays_) delays.push_back(sample.value);
  return !delays.empty() && median(std::move(delays)) > static_cast<double>(kLowDelayNs);
}

size_t FlowControl::choose_class(size_t present, std::span<const double> costs, double cap_bytes_per_s,
                                 int64_t time_ns) {
  if (costs.size() < 2 || (has_acks_ && last_ack_ns_ == 0)) return present;
  const double capacity = capacity_bytes_per_s(time_ns);
  const double usable = kUsableShare * capacity;
  const double allowed = cap_bytes_per_s <= 0.0 ? usable
                         : capacity > 0.0       ? std::min(usable, cap_bytes_per_s)
                                                : cap_bytes_per_s;
  if (quiet_since_ns_ == 0) {
    // The first choice, before any strand frame: by what the asset showed.
    quiet_since_ns_ = time_ns;
    size_t first = present;
    while (allowed > 0.0 && first + 1 < costs.size() && costs[first] > allowed) ++first;
    return first;
  }
  note_demand(costs[0], time_ns);
  const bool has_failed = has_failed_try(time_ns);
  if (!has_acks_ || (time_ns - quiet_since_ns_ < kSettleNs && !has_failed)) return present;
  const bool is_over_cap = cap_bytes_per_s > 0.0 && costs[present] > cap_bytes_per_s;
  if (is_over_cap || has_failed || is_troubled(time_ns)) {
    if (present + 1 == costs.size()) {
      quiet_since_ns_ = time_ns;  // nothing cheaper; what is better has to wait
      return present;
    }
    const size_t chosen = class_below(present, costs, allowed);
    change(present, chosen, time_ns);
    return chosen;
  }
  const bool has_delay = has_standing_delay();
  // Back to where it went well the way is short; what failed is tried more and more rarely.
  const int64_t wait_ns = present == 0 || present - 1 > failed_class_ ? kFirstProbeNs : probe_ns_;
  if (has_delay) quiet_since_ns_ = std::max(quiet_since_ns_, time_ns - wait_ns / 2);
  if (present == 0 || has_delay || time_ns - quiet_since_ns_ < wait_ns) return present;
  const double most = costs[present - 1] * demands_.front().value / costs[0];
  if (allowed > 0.0 && (costs[present - 1] > allowed || most > allowed / kUsableShare * kBurstShare))
    return present;
  change(present, present - 1, time_ns);
  return present - 1;
}

}  // namespace strandcast
