// FlowControl: what one viewer's link can take, learned from its acknowledgements: how many frames may be on
// their way, and which strand class (rate and bound) fits. Delay is the signal, as in TCP Vegas: a reliable
// transport shows no loss. Plain logic on given times, no I/O and no clock; network thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "common/strands/frame_header.h"

namespace strandcast {

inline constexpr int64_t kNsPerMs = 1'000'000;
/// Nothing new is sent while the oldest frame on its way is later than the bare link by more than this,
inline constexpr int64_t kGateDelayNs = 200 * kNsPerMs;
/// or while what is on its way keeps the link busy for longer than this: the frame itself takes time as well.
inline constexpr int64_t kGateQueueNs = 170 * kNsPerMs;
/// Nor a keyframe while more than this waits ahead of it: it fills the queue by itself.
inline constexpr int64_t kStartDelayNs = 50 * kNsPerMs;
/// Before the first acknowledgement nothing is known of a link: it gets one frame, and no more when it is
/// this large. Three times what TCP itself begins with (RFC 6928).
inline constexpr size_t kFirstBytes = 44u << 10;
/// So many frames may always be on their way: a viewer that draws slowly acknowledges in bursts.
inline constexpr size_t kFreeFrames = 3;
inline constexpr size_t kMaxInFlightBytes = 4u << 20;  // but one frame always may
inline constexpr size_t kMaxInFlightFrames = 512;
/// A link whose queue never drains below the first in kDelayWindowNs is too slow for its class; below the
/// second there may be room for more.
inline constexpr int64_t kHighDelayNs = 100 * kNsPerMs;
inline constexpr int64_t kLowDelayNs = 25 * kNsPerMs;
inline constexpr int64_t kDelayWindowNs = 500 * kNsPerMs;
inline constexpr size_t kMinDelaySamples = 3;
/// Lost chains that count as trouble when they fall within kLossWindowNs.
inline constexpr size_t kTroublingLosses = 2;
inline constexpr int64_t kLossWindowNs = 2'000 * kNsPerMs;
/// Share of the measured capacity that a class may take on average, and at most while the strands move
/// quickly, as they did once in kDemandWindowNs.
inline constexpr double kUsableShare = 0.85;
inline constexpr double kBurstShare = 1.4;
inline constexpr int64_t kDemandWindowNs = 15'000 * kNsPerMs;
/// Quiet time before a better class is tried; before one that failed it doubles with every try.
inline constexpr int64_t kFirstProbeNs = 3'000 * kNsPerMs;
inline constexpr int64_t kLongestProbeNs = 60'000 * kNsPerMs;
/// Trouble this soon after a change for the better means that the try has failed.
inline constexpr int64_t kProbationNs = 5'000 * kNsPerMs;
/// A capacity that was seen says nothing about the link after this long.
inline constexpr int64_t kCapacityAgeNs = 30'000 * kNsPerMs;
/// What a keyframe puts into the queue may take so long to drain; the frames behind it are late by no fault
/// of theirs.
inline constexpr int64_t kDrainNs = 3'000 * kNsPerMs;
/// No frame is expected to take longer, however slow the link seemed.
inline constexpr int64_t kLongestTransferNs = 30'000 * kNsPerMs;
/// Without any acknowledgement one more frame is sent this often.
inline constexpr int64_t kAskAgainNs = 1'000 * kNsPerMs;
inline constexpr int64_t kBaseWindowNs = 10'000 * kNsPerMs;  // of the shortest round trip

class FlowControl {
 public:
  /// Without acknowledgements nothing is known: everything may be sent, and the class stays. From a client
  /// that promises them, starts with the asset.
  void expect_acks() { has_acks_ = true; }
  bool expects_acks() const { return has_acks_; }
  /// Instead of kCapacityAgeNs.
  void remember_capacity_for(int64_t duration_ns) { capacity_age_ns_ = duration_ns; }
  /// Other frames follow: what was seen of the ones before is no reason to change the class.
  void start_over(int64_t time_ns) { quiet_since_ns_ = time_ns; }

  /// A media frame goes to the socket.
  void on_sent(const FrameHeader& header, size_t bytes, int64_t time_ns);
  /// The link has taken a part of this frame.
  void on_written(const FrameHeader& header, int64_t time_ns);
  /// Acknowledges this frame and all before it. Numbers that are not on their way are ignored.
  void on_ack(uint16_t stream_id, uint32_t sequence, int64_t time_ns);
  /// A round trip of something small.
  void on_round_trip(int64_t round_trip_ns, int64_t time_ns);
  /// The client could not use what is on its way: no acknowledgement will come.
  void forget_in_flight();
  /// A frame found no place, so that a keyframe is needed.
  void on_chain_loss(int64_t time_ns);

  /// Whether the next media frame may go to the socket.
  bool may_send(int64_t time_ns) const;
  /// Whether a keyframe or whole picture may be asked for: it would be on its way at once.
  bool may_start(int64_t time_ns) const;

  /// The class to be in, given the present one and what each costs, bytes/s, best first; at most
  /// `cap_bytes_per_s`, 0 = no cap. Call often. Remembers a change as made.
  size_t choose_class(size_t present, std::span<const double> costs, double cap_bytes_per_s, int64_t time_ns);

  /// How long data waits on its way, from the newest acknowledgement.
  int64_t queue_delay_ns() const { return queue_delay_ns_; }
  /// Round trip of the bare link; 0 while unknown.
  int64_t base_ns() const;
  /// Bytes/s; 0 while unknown: the link has not been the limit.
  double capacity_bytes_per_s(int64_t time_ns) const;
  size_t in_flight_bytes() const { return in_flight_bytes_; }
  /// When the acknowledgement of the oldest frame should be here, by what the link has shown and how far that
  /// frame has got: on a slow link it may take seconds. 0 = none waits.
  int64_t oldest_due_ns(int64_t time_ns) const;

 private:
  struct Frame {
    uint16_t stream_id = 0;
    uint32_t sequence = 0;
    bool is_large = false;  // stands alone: asset or keyframe
    bool is_asset = false;
    bool was_alone = false;  // nothing else was on its way
    size_t bytes = 0;
    int64_t sent_ns = 0;
  };
  struct Sample {
    int64_t time_ns = 0;
    double value = 0.0;
  };

  void take_sample(const Frame& frame, int64_t time_ns);
  void note_round_trip(int64_t round_trip_ns, int64_t time_ns);
  void note_capacity(const Frame& frame, int64_t round_trip_ns, int64_t time_ns);
  void note_busy_frame(const Frame& frame, int64_t time_ns);
  double busy_bytes_per_s(int64_t time_ns) const;
  int64_t transfer_ns(size_t bytes, int64_t time_ns) const;
  int64_t keyframe_allowance_ns(int64_t time_ns) const;
  int64_t expected_wait_ns(int64_t time_ns) const;
  bool is_trying(int64_t time_ns) const;
  bool has_failed_try(int64_t time_ns) const;
  void note_demand(double cost, int64_t time_ns);
  bool is_troubled(int64_t time_ns) const;
  bool has_standing_delay() const;
  size_t class_below(size_t present, std::span<const double> costs, double allowed) const;
  void change(size_t from, size_t to, int64_t time_ns);

  bool has_acks_ = false;
  int64_t capacity_age_ns_ = kCapacityAgeNs;
  std::deque<Frame> in_flight_;  // oldest first
  size_t in_flight_bytes_ = 0;
  int64_t last_ack_ns_ = 0;
  int64_t written_ns_ = 0;  // the link took a part of what was the oldest frame then
  // Acknowledgements come in bunches, as the client looks.
  int64_t bunch_ns_ = 0;         // the first one of the newest bunch
  int64_t before_bunch_ns_ = 0;  // the last one before it
  int64_t queue_delay_ns_ = 0;
  std::deque<Sample> round_trips_;  // increasing minima of the last kBaseWindowNs
  std::deque<Sample> delays_;       // queue delays of the last kDelayWindowNs
  std::deque<Sample> busy_rates_;   // bytes/s while the link was the limit, of spans of kBusySpanNs
  double busy_bytes_ = 0.0;         // of the span under way
  int64_t busy_ns_ = 0;
  std::deque<Sample> demands_;       // decreasing maxima: what the next better class would have cost
  std::optional<Sample> seen_rate_;  // bytes/s of the newest large frame
  std::optional<Frame> keyframe_;    // the newest one sent
  std::deque<int64_t> losses_ns_;
  int64_t quiet_since_ns_ = 0;  // the last trouble or change
  int64_t improved_ns_ = 0;     // the last change, if it was for the better
  int64_t probe_ns_ = kFirstProbeNs;
  size_t failed_class_ = 0;  // that was tried last and failed; probe_ns_ is for it and for better ones
};

}  // namespace strandcast
