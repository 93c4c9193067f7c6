// SendGate: limits the frames in flight to a viewer, so that a slow link's queue stays short. Plain logic on
// given times, no I/O and no clock; network thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "common/base/units.h"
#include "common/strands/frame_header.h"
#include "server/net/link_estimate.h"

namespace strandcast {

/// Delay of the oldest frame in flight, beyond that of the unloaded link, above which nothing new is sent.
inline constexpr int64_t kGateDelayNs = 200 * kMsInNs;
/// Time that the link needs for the frames in flight, above which nothing new is sent.
inline constexpr int64_t kGateQueueNs = 170 * kMsInNs;
/// Queueing delay above which no keyframe is sent, since a keyframe fills the queue by itself.
inline constexpr int64_t kStartDelayNs = 50 * kMsInNs;
/// Bytes in flight from which nothing more is sent before the first acknowledgement; the frame that reaches
/// them may have any size. Three times TCP's initial window (RFC 6928).
inline constexpr size_t kFirstBytes = 44u << 10;
/// Number of frames that may always be in flight, because a viewer that draws slowly acknowledges in bursts.
inline constexpr size_t kFreeFrames = 3;
inline constexpr size_t kMaxInFlightBytes = 4u << 20;  // but one frame always may
inline constexpr size_t kMaxInFlightFrames = 512;
/// Time in which a keyframe's queue may drain; frames after it are not late through their own fault.
inline constexpr int64_t kDrainNs = 3'000 * kMsInNs;
/// Longest expected transfer of a frame, however slow the link seemed.
inline constexpr int64_t kLongestTransferNs = 30'000 * kMsInNs;
/// Interval at which one more frame is sent without any acknowledgement.
inline constexpr int64_t kAskAgainNs = 1'000 * kMsInNs;

class SendGate {
 public:
  /// Makes a gate; `link` must outlive it.
  explicit SendGate(const LinkEstimate& link) : link_(link) {}

  /// Notes that a media frame is written to the socket.
  void on_sent(const FrameHeader& header, size_t bytes, int64_t time_ns);
  /// Notes that the link has taken a part of this frame.
  void on_written(const FrameHeader& header, int64_t time_ns);
  /// Removes this frame and all before it from those in flight; empty for numbers that are not in flight.
  std::optional<AckedFrame> take_acked(uint16_t stream_id, uint32_t sequence);
  /// Returns the asset where all else waits for it, and the link has nothing else to do.
  const AckedFrame* asset_alone() const;
  /// Lets other frames follow the asset before it is acknowledged; while the link is unknown, a single one.
  void pass_asset() {
    in_flight_.front().is_asset = false;
    is_asset_passed_ = true;
  }
  /// Forgets the frames in flight, which will not be acknowledged.
  void forget();

  enum class Delay { Usual, Short };
  /// Returns whether the next media frame may be sent. Short: while a better class is tried.
  bool may_send(Delay delay, int64_t time_ns) const;
  /// Returns whether a keyframe or whole picture would be sent at once, if may_send().
  bool has_short_queue(int64_t time_ns) const { return expected_wait_ns(time_ns) <= kStartDelayNs; }
  size_t in_flight_bytes() const { return in_flight_bytes_; }
  /// Returns when the oldest frame's acknowledgement is expected, by the link's estimate and the frame's
  /// progress; on a slow link that may be seconds. 0 = none waits.
  int64_t oldest_due_ns(int64_t time_ns) const;

 private:
  struct Frame {
    uint16_t stream_id = 0;
    uint32_t sequence = 0;
    bool is_asset = false;
    AckedFrame sent;  // what it will be when it is acknowledged
  };
  int64_t keyframe_allowance_ns(int64_t time_ns) const;
  int64_t expected_wait_ns(int64_t time_ns) const;

  const LinkEstimate& link_;
  std::deque<Frame> in_flight_;  // oldest first
  size_t in_flight_bytes_ = 0;
  bool is_asset_passed_ = false;
  int64_t written_ns_ = 0;         // the link took a part of what was the oldest frame then
  std::optional<Frame> keyframe_;  // the newest one sent
};

}  // namespace strandcast
