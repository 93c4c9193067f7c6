// SendGate: how many frames may be on their way to a viewer, so that a slow link's queue stays short. Plain
// logic on given times, no I/O and no clock; network thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "common/base/units.h"
#include "common/strands/frame_header.h"
#include "server/net/link_estimate.h"

namespace strandcast {

/// Nothing new is sent while the oldest frame on its way is later than the bare link by more than this,
inline constexpr int64_t kGateDelayNs = 200 * kMsInNs;
/// or while what is on its way keeps the link busy for longer than this: the frame itself takes time as well.
inline constexpr int64_t kGateQueueNs = 170 * kMsInNs;
/// Nor a keyframe while more than this waits ahead of it: it fills the queue by itself.
inline constexpr int64_t kStartDelayNs = 50 * kMsInNs;
/// Before the first acknowledgement nothing is known of a link: it gets one frame, and no more when it is
/// this large. Three times what TCP itself begins with (RFC 6928).
inline constexpr size_t kFirstBytes = 44u << 10;
/// So many frames may always be on their way: a viewer that draws slowly acknowledges in bursts.
inline constexpr size_t kFreeFrames = 3;
inline constexpr size_t kMaxInFlightBytes = 4u << 20;  // but one frame always may
inline constexpr size_t kMaxInFlightFrames = 512;
/// What a keyframe puts into the queue may take so long to drain; the frames behind it are late by no fault
/// of theirs.
inline constexpr int64_t kDrainNs = 3'000 * kMsInNs;
/// No frame is expected to take longer, however slow the link seemed.
inline constexpr int64_t kLongestTransferNs = 30'000 * kMsInNs;
/// Without any acknowledgement one more frame is sent this often.
inline constexpr int64_t kAskAgainNs = 1'000 * kMsInNs;

class SendGate {
 public:
  /// `link` outlives the gate.
  explicit SendGate(const LinkEstimate& link) : link_(link) {}

  /// A media frame goes to the socket.
  void on_sent(const FrameHeader& header, size_t bytes, int64_t time_ns);
  /// The link has taken a part of this frame.
  void on_written(const FrameHeader& header, int64_t time_ns);
  /// Takes this frame and all before it off the way. Nothing for numbers that are not on their way.
  std::optional<AckedFrame> take_acked(uint16_t stream_id, uint32_t sequence);
  /// No acknowledgement will come for what is on its way.
  void forget();

  enum class Delay { Usual, Short };
  /// Whether the next media frame may go to the socket. Short: while a better class is tried.
  bool may_send(Delay delay, int64_t time_ns) const;
  /// Whether a keyframe or whole picture would be on its way at once, if may_send().
  bool has_short_queue(int64_t time_ns) const { return expected_wait_ns(time_ns) <= kStartDelayNs; }
  size_t in_flight_bytes() const { return in_flight_bytes_; }
  /// When the acknowledgement of the oldest frame should be here, by what the link has shown and how far that
  /// frame has got: on a slow link it may take seconds. 0 = none waits.
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
  int64_t written_ns_ = 0;         // the link took a part of what was the oldest frame then
  std::optional<Frame> keyframe_;  // the newest one sent
};

}  // namespace strandcast
