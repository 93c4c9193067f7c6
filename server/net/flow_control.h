// FlowControl: learns from acknowledgements what one viewer's link can take. It limits the frames in flight
// (SendGate) and chooses the class of frames (ClassChoice), both based on LinkEstimate. Plain logic on given
// times, no I/O and no clock; network thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "common/strands/frame_header.h"
#include "server/net/class_choice.h"
#include "server/net/link_estimate.h"
#include "server/net/send_gate.h"
#include "server/net/strand_class.h"

namespace strandcast {

class FlowControl {
 public:
  FlowControl() = default;
  FlowControl(const FlowControl&) = delete;
  FlowControl& operator=(const FlowControl&) = delete;

  /// Enables flow control for a client that promises acknowledgements, starting with the asset. Otherwise
  /// everything may be sent and the class stays.
  void expect_acks() { has_acks_ = true; }
  bool expects_acks() const { return has_acks_; }
  /// Replaces kCapacityAgeNs.
  void remember_capacity_for(int64_t duration_ns) { link_.remember_capacity_for(duration_ns); }
  /// Resets the observations, because other frames follow.
  void start_over(int64_t time_ns) { choice_.start_over(time_ns); }

  /// Notes that a media frame is written to the socket.
  void on_sent(const FrameHeader& header, size_t bytes, int64_t time_ns) {
    if (has_acks_) gate_.on_sent(header, bytes, time_ns);
  }
  /// Notes that the link has taken a part of this frame.
  void on_written(const FrameHeader& header, int64_t time_ns) { gate_.on_written(header, time_ns); }
  /// Returns whether all else waits for the asset.
  bool awaits_asset() const { return has_acks_ && gate_.asset_alone() != nullptr; }
  /// Notes how many bytes of the asset are still on their way, by TCP's own acknowledgements. When half of it
  /// has come slowly, the link is known, and others may follow without a gap.
  void on_asset_left(size_t bytes, int64_t time_ns);
  /// Lets one small frame follow an asset that is later than this, although its acknowledgement still has to
  /// tell what the link carries. Returns whether it does.
  bool pass_late_asset(int64_t late_ns, int64_t time_ns);
  /// Acknowledges this frame and all before it; numbers that are not in flight are ignored.
  void on_ack(uint16_t stream_id, uint32_t sequence, int64_t time_ns, const ClientTimes& client = {});
  /// Adds the round trip time of a small message.
  void on_round_trip(int64_t round_trip_ns, int64_t time_ns) { link_.on_round_trip(round_trip_ns, time_ns); }
  /// Forgets the frames in flight, because the client could not use them and will not acknowledge them.
  void forget_in_flight() { gate_.forget(); }
  /// Notes that a frame was dropped, so that a keyframe is needed.
  void on_chain_loss(int64_t time_ns);

  /// Returns whether the next media frame may be written to the socket.
  bool may_send(int64_t time_ns) const;
  /// Returns whether a keyframe or whole picture may be requested, because it could be sent at once.
  bool may_start(int64_t time_ns) const;

  struct Classes {
    size_t present = 0;
    std::span<const double> costs;              // bytes/s of each, best first
    double cap_bytes_per_s = 0.0;               // of any; 0 = none
    std::span<const StrandClass> strands = {};  // where they are of strands
  };
  /// Returns the class to use and notes it as the present one; call it often.
  size_t choose_class(const Classes& classes, int64_t time_ns);
  /// Returns the class with which another codec begins: the best that the link carries, as far as costs and
  /// link are known. Forgets what the frames of the codec before have shown of decoding and of better
  /// classes.
  size_t begin_codec(const Classes& classes, int64_t time_ns);

  /// Returns the queueing delay according to the newest acknowledgement.
  int64_t queue_delay_ns() const { return queue_delay_ns_; }
  /// Returns LinkEstimate::base_ns().
  int64_t base_ns() const { return link_.base_ns(); }
  double capacity_bytes_per_s(int64_t time_ns) const { return link_.capacity_bytes_per_s(time_ns); }
  /// Returns LinkEstimate::transfer_ns().
  int64_t transfer_ns(size_t bytes, int64_t time_ns) const { return link_.transfer_ns(bytes, time_ns); }
  size_t in_flight_bytes() const { return gate_.in_flight_bytes(); }
  /// Returns SendGate::oldest_due_ns().
  int64_t oldest_due_ns(int64_t time_ns) const { return gate_.oldest_due_ns(time_ns); }

 private:
  double allowed_bytes_per_s(const Classes& classes, int64_t time_ns) const;
  std::vector<double> decode_shares(const Classes& classes) const;
  void expect_decodes(const Classes& classes, size_t chosen);

  bool has_acks_ = false;
  LinkEstimate link_;
  SendGate gate_{link_};
  ClassChoice choice_;
  int64_t queue_delay_ns_ = 0;
  std::deque<int64_t> decodes_ns_;  // of the newest deltas of the present class
};

}  // namespace strandcast
