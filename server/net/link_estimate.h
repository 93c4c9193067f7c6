// LinkEstimate: estimates a link from acknowledged frames: its unloaded round trip and its capacity. It uses
// delay as the signal, as TCP Vegas does, because a reliable transport shows no loss. Plain logic on given
// times, no I/O and no clock; network thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "common/base/units.h"

namespace strandcast {
/// Delay below which the link has no queue.
inline constexpr int64_t kLowDelayNs = 25 * kMsInNs;
inline constexpr int64_t kHighDelayNs = 100 * kMsInNs;
/// Age beyond which a measured capacity is discarded.
inline constexpr int64_t kCapacityAgeNs = 30'000 * kMsInNs;
inline constexpr int64_t kBaseWindowNs = 10'000 * kMsInNs;  // of the shortest round trip
/// Age of the shortest round trip beyond which a longer one replaces it.
inline constexpr int64_t kLongerPathNs = 2'000 * kMsInNs;

/// A value with its time.
struct TimedValue {
  int64_t time_ns = 0;
  double value = 0.0;
};

/// Times of a frame that the client reports, on its own clock.
struct ClientTimes {
  int64_t received_ns = 0;  // by its own clock; 0 = unknown
  int64_t decode_ns = 0;
};

/// A frame that the client has acknowledged.
struct AckedFrame {
  size_t bytes = 0;
  int64_t sent_ns = 0;
  bool is_large = false;   // stands alone: asset or keyframe
  bool was_alone = false;  // nothing else was on its way
  ClientTimes client = {};
};

class LinkEstimate {
 public:
  /// Replaces kCapacityAgeNs.
  void remember_capacity_for(int64_t duration_ns) { capacity_age_ns_ = duration_ns; }
  /// Takes an acknowledgement; returns how long the frame waited in flight and at the client, ns.
  int64_t on_acked(const AckedFrame& frame, int64_t time_ns);
  /// Returns the delay of the newest frame that the link caused: the total less the client's absence. For
  /// clients that do not report reception times it is the total.
  int64_t link_delay_ns() const { return link_delay_ns_; }
  /// Adds the round trip time of a small message.
  void on_round_trip(int64_t round_trip_ns, int64_t time_ns);
  /// Takes a first rate from the bytes that have arrived of a frame that is still on its way.
  void on_part(const AckedFrame& frame, size_t bytes, int64_t time_ns);

  /// Returns the round trip time of the unloaded link; 0 while unknown.
  int64_t base_ns() const;
  /// Returns the capacity in bytes/s; 0 while unknown because the link was never the limit.
  double capacity_bytes_per_s(int64_t time_ns) const;
  /// Returns how long the link needs for this many bytes; 0 while unknown.
  int64_t transfer_ns(size_t bytes, int64_t time_ns) const;
  /// Returns the time of the last acknowledgement; 0 = none yet.
  int64_t last_ack_ns() const { return last_ack_ns_; }

 private:
  void note_round_trip(int64_t round_trip_ns, int64_t time_ns);
  int64_t arrival_ns(const AckedFrame& frame, int64_t time_ns);
  void note_look(int64_t arrived_ns);
  int64_t shortest_way_ns() const;
  void note_capacity(const AckedFrame& frame, int64_t taken_ns, int64_t time_ns);
  int64_t taken_ns(const AckedFrame& frame, int64_t arrived_ns, int64_t time_ns) const;
  void note_busy_frame(const AckedFrame& frame, int64_t arrived_ns, int64_t time_ns);
  double busy_bytes_per_s(int64_t time_ns) const;

  int64_t capacity_age_ns_ = kCapacityAgeNs;
  int64_t last_ack_ns_ = 0;
  // Frames come in bunches, as the client looks: by its clock where it tells that, else by when they are
  // acknowledged.
  bool has_client_clock_ = true;
  int64_t arrived_ns_ = 0;       // the newest; 0 = none yet
  int64_t bunch_ns_ = 0;         // the first one of the newest bunch
  int64_t before_bunch_ns_ = 0;  // the last one before it
  int64_t link_delay_ns_ = 0;
  std::deque<TimedValue> round_trips_;  // increasing minima of the last kBaseWindowNs
  std::deque<TimedValue> ways_;         // likewise, from our clock to the client's
  std::deque<TimedValue> busy_rates_;   // bytes/s while the link was the limit, of spans of kBusySpanNs
  double busy_bytes_ = 0.0;             // of the span under way
  int64_t busy_ns_ = 0;
  std::optional<TimedValue> first_part_;  // bytes of a first frame that is still on its way
  std::optional<TimedValue> seen_rate_;   // bytes/s of the newest large frame
};

}  // namespace strandcast
