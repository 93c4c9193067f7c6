#include "server/net/link_estimate.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "common/base/quantile.h"
#include "common/base/units.h"

namespace strandcast {
namespace {

/// Round trips shorter than this differ by scheduling, not by the link.
constexpr int64_t kLeastTransferNs = kMsInNs;
constexpr size_t kMaxBusySamples = 16;
/// A rate is taken over at least this: frames and acknowledgements come in bunches.
constexpr int64_t kBusySpanNs = 50 * kMsInNs;
/// A part of a frame that came sooner shows how TCP starts, or a proxy's buffer, not the link. What follows
/// shows it over kPartSpanNs.
constexpr int64_t kFirstPartNs = 50 * kMsInNs;
constexpr int64_t kPartSpanNs = 150 * kMsInNs;
/// Difference of round trips that has other reasons than the rate: jitter, or a client that looks only now
/// and then.
constexpr int64_t kJitterNs = 50 * kMsInNs;
constexpr size_t kMinBusySamples = 3;
constexpr int64_t kBusyAgeNs = 2'000 * kMsInNs;
/// Times of clients are untrusted: differences from ours must fit.
constexpr int64_t kLatestClientNs = int64_t{1} << 62;

/// Keeps the candidates for the minimum of the window: each newer one is longer than all before it.
void note_minimum(std::deque<TimedValue>& minima, const TimedValue& sample) {
  while (!minima.empty() && minima.back().value >= sample.value) minima.pop_back();
  minima.push_back(sample);
  while (minima.front().time_ns < sample.time_ns - kBaseWindowNs) minima.pop_front();
}

}  // namespace

int64_t LinkEstimate::on_acked(const AckedFrame& frame, int64_t time_ns) {
  const int64_t arrived_ns = arrival_ns(frame, time_ns);
  note_look(arrived_ns);
  const int64_t round_trip_ns = time_ns - frame.sent_ns;
  const int64_t known_base_ns = round_trips_.empty() ? round_trip_ns : base_ns();
  note_capacity(frame, taken_ns(frame, arrived_ns, time_ns), time_ns);
  note_busy_frame(frame, arrived_ns, time_ns);
  const int64_t own_ns = transfer_ns(frame.bytes, time_ns);
  // Alone on its way a frame waits for nothing: what is left is the bare link, which may have become longer.
  const int64_t bare_ns = std::max<int64_t>(round_trip_ns - own_ns, kLeastTransferNs);
  if (frame.was_alone && !round_trips_.empty() && bare_ns > base_ns() + kHighDelayNs &&
      time_ns - round_trips_.front().time_ns > kLongerPathNs) {
    round_trips_.clear();
    ways_.clear();
  }
  note_round_trip(frame.was_alone ? bare_ns : round_trip_ns, time_ns);
  const int64_t delay_ns = std::max<int64_t>(round_trip_ns - base_ns() - own_ns, 0);
  link_delay_ns_ = delay_ns;
  if (has_client_clock_) {
    // No more than it took beyond something small: the link may carry more than is known.
    const int64_t on_link_ns =
        frame.was_alone ? std::clamp<int64_t>(round_trip_ns - known_base_ns, 0, own_ns) : 0;
    const int64_t way_ns = arrived_ns - frame.sent_ns - on_link_ns;
    note_minimum(ways_, {time_ns, static_cast<double>(way_ns)});
    const int64_t due_ns = frame.sent_ns + shortest_way_ns() + own_ns;
    const int64_t looked_ns = before_bunch_ns_ > 0 ? before_bunch_ns_ : arrived_ns;
    link_delay_ns_ = std::clamp<int64_t>(looked_ns - due_ns, 0, delay_ns);
  }
  arrived_ns_ = arrived_ns;
  last_ack_ns_ = time_ns;
  return delay_ns;
}

/// By the clock that bunches are seen with. A client whose times do not get on has none.
int64_t LinkEstimate::arrival_ns(const AckedFrame& frame, int64_t time_ns) {
  const int64_t received_ns = frame.client.received_ns;
  const bool is_told = received_ns > arrived_ns_ && received_ns < kLatestClientNs;
  if (has_client_clock_ && !is_told) {
    has_client_clock_ = false;
    ways_.clear();
    arrived_ns_ = last_ack_ns_;
    bunch_ns_ = before_bunch_ns_ = 0;
  }
  return has_client_clock_ ? received_ns : time_ns;
}

void LinkEstimate::note_look(int64_t arrived_ns) {
  if (arrived_ns - bunch_ns_ < kLeastTransferNs) return;
  before_bunch_ns_ = arrived_ns_;
  bunch_ns_ = arrived_ns;
}

/// Returns the shortest way to the client, by our clock and that of arrival_ns().
int64_t LinkEstimate::shortest_way_ns() const {
  if (!has_client_clock_ || ways_.empty()) return base_ns();
  return static_cast<int64_t>(ways_.front().value);
}

void LinkEstimate::on_round_trip(int64_t round_trip_ns, int64_t time_ns) {
  if (round_trip_ns >= 0) note_round_trip(std::max(round_trip_ns, kLeastTransferNs), time_ns);
}

void LinkEstimate::on_part(const AckedFrame& frame, size_t bytes, int64_t time_ns) {
  if (seen_rate_ || round_trips_.empty() || time_ns - frame.sent_ns - base_ns() < kFirstPartNs) return;
  if (!first_part_) first_part_ = {time_ns, static_cast<double>(bytes)};
  const int64_t duration_ns = time_ns - first_part_->time_ns;
  const double more = static_cast<double>(bytes) - first_part_->value;
  if (2 * bytes < frame.bytes || duration_ns < kPartSpanNs || !(more > 0.0)) return;
  seen_rate_ = {time_ns, more * kNsPerS / static_cast<double>(duration_ns)};
}

void LinkEstimate::note_round_trip(int64_t round_trip_ns, int64_t time_ns) {
  note_minimum(round_trips_, {time_ns, static_cast<double>(round_trip_ns)});
}

int64_t LinkEstimate::base_ns() const {
  return round_trips_.empty() ? 0 : static_cast<int64_t>(round_trips_.front().value);
}

/// How much longer the frame took than something small. What the client did before it acknowledged does not
/// count.
int64_t LinkEstimate::taken_ns(const AckedFrame& frame, int64_t arrived_ns, int64_t time_ns) const {
  const int64_t by_answer_ns = time_ns - frame.sent_ns - base_ns() - frame.client.decode_ns;
  if (!has_client_clock_ || ways_.empty()) return by_answer_ns;
  return std::min(by_answer_ns, arrived_ns - frame.sent_ns - shortest_way_ns());
}

void LinkEstimate::note_capacity(const AckedFrame& frame, int64_t taken_ns, int64_t time_ns) {
  // A large frame that met nothing on its way shows the rate by how much longer it took than something small.
  // One that took about as long as expected shows nothing new, least of all a short one.
  if (frame.is_large && frame.was_alone && !round_trips_.empty()) {
    const int64_t duration_ns = std::max(taken_ns, kLeastTransferNs);
    const bool is_known = seen_rate_ && seen_rate_->time_ns >= time_ns - capacity_age_ns_;
    const auto bytes = static_cast<double>(frame.bytes);
    const int64_t expected_ns = is_known ? static_cast<int64_t>(bytes / seen_rate_->value * kNsPerS) : 0;
    if (!is_known || std::abs(duration_ns - expected_ns) > kJitterNs)
      seen_rate_ = {time_ns, bytes * kNsPerS / static_cast<double>(duration_ns)};
  }
}

/// Collects frames that should have been here when the client looked last, and were not: since then the link
/// was busy with them.
void LinkEstimate::note_busy_frame(const AckedFrame& frame, int64_t arrived_ns, int64_t time_ns) {
  const bool was_queued =
      before_bunch_ns_ > 0 && frame.sent_ns + shortest_way_ns() + kLowDelayNs <= before_bunch_ns_;
  if (!was_queued) {
    busy_bytes_ = 0.0;
    busy_ns_ = 0;
    return;
  }
  const int64_t since_last_ns = arrived_ns - arrived_ns_;
  // Frames come in bunches; the end of one is known when the next begins.
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

/// What the link carried while it was the limit; 0 when it has not been of late.
double LinkEstimate::busy_bytes_per_s(int64_t time_ns) const {
  std::vector<double> rates;
  for (const TimedValue& sample : busy_rates_)
    if (sample.time_ns >= time_ns - kBusyAgeNs) rates.push_back(sample.value);
  // A freeze makes one long interval and many of nearly nothing, a slow link makes all alike.
  return rates.size() >= kMinBusySamples ? median(std::move(rates)) : 0.0;
}

double LinkEstimate::capacity_bytes_per_s(int64_t time_ns) const {
  if (const double rate = busy_bytes_per_s(time_ns); rate > 0.0) return rate;
  const bool is_known = seen_rate_ && seen_rate_->time_ns >= time_ns - capacity_age_ns_;
  return is_known ? seen_rate_->value : 0.0;
}

int64_t LinkEstimate::transfer_ns(size_t bytes, int64_t time_ns) const {
  const double capacity = capacity_bytes_per_s(time_ns);
  return capacity > 0.0 ? static_cast<int64_t>(static_cast<double>(bytes) / capacity * kNsPerS) : 0;
}

}  // namespace strandcast
