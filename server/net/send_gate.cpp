#include "server/net/send_gate.h"

#include <algorithm>

#include "common/base/units.h"

namespace strandcast {
namespace {

constexpr int64_t kKeyframeSlackNs = kGateDelayNs / 2;

/// What takes the place of many frames that build on each other.
bool is_keyframe(const FrameHeader& header) {
  return header.opcode == Opcode::StrandKeyframe ||
         (is_chained_picture(header.opcode) && header.base_sequence == 0);
}

}  // namespace

void SendGate::on_sent(const FrameHeader& header, size_t bytes, int64_t time_ns) {
  const bool is_asset = header.opcode == Opcode::Asset;
  const AckedFrame sent{bytes, time_ns, is_asset || is_keyframe(header), in_flight_.empty()};
  in_flight_.push_back({header.stream_id, header.sequence, is_asset, sent});
  in_flight_bytes_ += bytes;
  if (is_keyframe(header)) keyframe_ = in_flight_.back();
}

void SendGate::on_written(const FrameHeader& header, int64_t time_ns) {
  // What follows is no sign of life: a kernel takes it in for a client that sleeps.
  if (!in_flight_.empty() && in_flight_.front().stream_id == header.stream_id &&
      in_flight_.front().sequence == header.sequence)
    written_ns_ = time_ns;
}

std::optional<AckedFrame> SendGate::take_acked(uint16_t stream_id, uint32_t sequence) {
  const auto acked = std::find_if(in_flight_.begin(), in_flight_.end(), [&](const Frame& frame) {
    return frame.stream_id == stream_id && frame.sequence == sequence;
  });
  if (acked == in_flight_.end()) return std::nullopt;
  // Frames before it that were not acknowledged could not be used; they have arrived all the same.
  const AckedFrame frame = acked->sent;
  for (auto skipped = in_flight_.begin(); skipped <= acked; ++skipped)
    in_flight_bytes_ -= skipped->sent.bytes;
  in_flight_.erase(in_flight_.begin(), acked + 1);
  return frame;
}

const AckedFrame* SendGate::asset_alone() const {
  return in_flight_.size() == 1 && in_flight_.front().is_asset ? &in_flight_.front().sent : nullptr;
}

void SendGate::forget() {
  in_flight_.clear();
  in_flight_bytes_ = 0;
}

int64_t SendGate::oldest_due_ns(int64_t time_ns) const {
  if (in_flight_.empty()) return 0;
  const Frame& oldest = in_flight_.front();
  return std::max({oldest.sent.sent_ns, link_.last_ack_ns(), written_ns_}) + link_.base_ns() +
         std::min(link_.transfer_ns(oldest.sent.bytes, time_ns), kLongestTransferNs);
}

/// How long frames may wait behind a keyframe that fills the gate by itself, while its queue drains: they
/// would be held for being late otherwise, and the next keyframe would be due already.
int64_t SendGate::keyframe_allowance_ns(int64_t time_ns) const {
  if (!keyframe_) return 0;
  const int64_t own_ns = link_.transfer_ns(keyframe_->sent.bytes, time_ns);
  const int64_t draining_ns = std::max<int64_t>(time_ns - keyframe_->sent.sent_ns - own_ns, 0);
  if (draining_ns >= kDrainNs) return 0;
  const double left = 1.0 - static_cast<double>(draining_ns) / static_cast<double>(kDrainNs);
  return static_cast<int64_t>(left * static_cast<double>(std::min(own_ns, kDrainNs) + kKeyframeSlackNs));
}

/// How long a frame sent now waits until the link is free, by what is on its way; 0 while the capacity is
/// unknown.
int64_t SendGate::expected_wait_ns(int64_t time_ns) const {
  const double capacity = link_.capacity_bytes_per_s(time_ns);
  if (capacity <= 0.0) return 0;
  // The last one acknowledged left the link half a bare round trip after it was its turn and half of one ago.
  int64_t free_ns = link_.last_ack_ns() - link_.base_ns();
  for (const Frame& frame : in_flight_)
    free_ns = std::max(free_ns, frame.sent.sent_ns) +
              static_cast<int64_t>(static_cast<double>(frame.sent.bytes) / capacity * kNsPerS);
  return std::max<int64_t>(free_ns - time_ns, 0);
}

bool SendGate::may_send(Delay delay, int64_t time_ns) const {
  if (in_flight_.empty()) return true;
  if (in_flight_bytes_ >= kMaxInFlightBytes || in_flight_.size() >= kMaxInFlightFrames) return false;
  const Frame& oldest = in_flight_.front();
  // What the link can do shows when the asset or the first picture arrives; all else waits for that.
  const bool is_unknown = link_.last_ack_ns() == 0 && link_.capacity_bytes_per_s(time_ns) <= 0.0;
  if (oldest.is_asset) return false;
  if (is_unknown && in_flight_bytes_ >= kFirstBytes) return is_asset_passed_ && in_flight_.size() == 1;
  // Acknowledgements may get lost with a client's queue: it is asked again, slowly, and never given up here.
  if (time_ns - in_flight_.back().sent.sent_ns >= kAskAgainNs) return true;
  const int64_t allowance_ns = keyframe_allowance_ns(time_ns);
  if (expected_wait_ns(time_ns) > std::max(kGateQueueNs, allowance_ns)) return false;
  // Behind a keyframe may follow what is cheaper than another keyframe would be.
  if (oldest.sent.is_large && in_flight_bytes_ <= 2 * oldest.sent.bytes) return true;
  if (in_flight_.size() < kFreeFrames) return true;
  // A try fills the queue for a round trip before that shows.
  const int64_t gate_ns = delay == Delay::Short ? kStartDelayNs : kGateDelayNs;
  return time_ns - oldest.sent.sent_ns <=
         link_.base_ns() + link_.transfer_ns(oldest.sent.bytes, time_ns) + std::max(gate_ns, allowance_ns);
}

}  // namespace strandcast
