// libFuzzer entry: what one session sends, for a viewer that acknowledges, asks and stalls as it likes: the
// send queue and the flow control, put together as a session does, without a socket. Steps of one byte for
// the kind and a few for its numbers.
#include <array>
#include <cmath>
#include <optional>

#include "common/base/check.h"
#include "server/net/flow_control.h"
#include "server/net/send_queue.h"
#include "tests/fuzz/fuzz_input.h"

namespace strandcast::session_flow_fuzz {
namespace {

constexpr std::array<double, 3> kClassCosts = {1e6, 3e5, 1e5};  // bytes/s
constexpr int kMostSteps = 2'000;

enum class Step : uint8_t { Publish, Keyframe, Written, Ack, AckAnything, Ask, Pong, Control, Wait, Adapt };
constexpr int kStepKinds = 10;

class SessionGame {
 public:
  SessionGame() {
    flow_.expect_acks();
    FrameHeader header;
    header.opcode = Opcode::Asset;
    queue_.set_asset(make_encoded_frame(header, std::array<std::byte, 100>{}));
    queue_.start_strands();
    pump();
  }

  void step(Step kind, FuzzInput& input) {
    switch (kind) {
      case Step::Publish:
        publish(Opcode::StrandDelta, input.take<uint16_t>());
        break;
      case Step::Keyframe:
        publish(Opcode::StrandKeyframe, input.take<uint16_t>());
        break;
      case Step::Written:
        if (media_on_way_) queue_.written();
        media_on_way_ = false;
        break;
      case Step::Ack:
        flow_.on_ack(viewer_class_, viewer_sequence_ - input.take<uint8_t>() % 4, time_ns_);
        break;
      case Step::AckAnything: {
        const auto stream_id = input.take<uint16_t>();
        const auto sequence = input.take<uint32_t>();
        flow_.on_ack(stream_id, sequence, time_ns_, {input.take<int64_t>(), input.take<uint32_t>()});
        break;
      }
      case Step::Ask:
        queue_.lose_chain();
        flow_.forget_in_flight();
        break;
      case Step::Pong:
        flow_.on_round_trip(input.take<uint16_t>() * int64_t{10'000}, time_ns_);
        break;
      case Step::Control:
        if (queue_.push_control(Notice{})) ++control_count_;
        break;
      case Step::Wait:
        time_ns_ += input.take<uint16_t>() * int64_t{100'000};
        break;
      case Step::Adapt:
        adapt();
        break;
    }
    pump();
    check();
  }

 private:
  void publish(Opcode opcode, uint16_t byte_count) {
    FrameHeader header;
    header.opcode = opcode;
    header.stream_id = static_cast<uint16_t>(class_);
    header.base_sequence = opcode == Opcode::StrandDelta ? sequence_ : 0;
    header.sequence = sequence_ + 1;
    const std::vector<std::byte> payload(byte_count);
    if (queue_.offer_strands(make_encoded_frame(header, payload)) == SendQueue::Offer::LostChain)
      flow_.on_chain_loss(time_ns_);
    ++sequence_;
  }

  void adapt() {
    const size_t chosen = flow_.choose_class({class_, kClassCosts}, time_ns_);
    CHECK(chosen < kClassCosts.size());
    if (chosen == class_) return;
    class_ = chosen;
    queue_.restart_strands();
  }

  void pump() {
    if (media_on_way_) return;
    while (true) {
      const auto media = flow_.may_send(time_ns_) ? SendQueue::Media::Allowed : SendQueue::Media::Held;
      const auto item = queue_.take_next(media);
      if (!item) return;
      if (std::holds_alternative<ServerMessage>(*item)) {
        CHECK(control_count_ > 0);
        --control_count_;
        continue;
      }
      CHECK(media == SendQueue::Media::Allowed && control_count_ == 0);
      receive(*std::get<EncodedFramePtr>(*item));
      return;
    }
  }

  /// What the viewer gets must be decodable for it: the asset, a keyframe, and the chain from there.
  void receive(const EncodedFrame& frame) {
    const FrameHeader& header = frame.header;
    CHECK((header.opcode == Opcode::Asset) == !has_asset_);
    if (header.opcode == Opcode::StrandDelta)
      CHECK(header.base_sequence == viewer_sequence_ && header.stream_id == viewer_class_);
    has_asset_ = true;
    if (header.opcode != Opcode::Asset) {
      viewer_sequence_ = header.sequence;
      viewer_class_ = header.stream_id;
    }
    flow_.on_sent(header, frame.message.size(), time_ns_);
    media_on_way_ = true;
  }

  void check() const {
    constexpr size_t kLargestFrame = kFrameHeaderBytes + 65'535;
    CHECK(flow_.in_flight_bytes() <= kMaxInFlightBytes + kLargestFrame);
    CHECK(flow_.queue_delay_ns() >= 0 && flow_.base_ns() >= 0);
    CHECK(std::isfinite(flow_.capacity_bytes_per_s(time_ns_)));
    CHECK(flow_.oldest_due_ns(time_ns_) <= time_ns_ + flow_.base_ns() + kLongestTransferNs);
    CHECK(control_count_ <= kMaxQueuedControl);
  }

  SendQueue queue_;
  FlowControl flow_;
  int64_t time_ns_ = 1;
  size_t class_ = 0;
  uint32_t sequence_ = 0;  // newest published
  uint32_t viewer_sequence_ = 0;
  uint16_t viewer_class_ = 0;
  bool has_asset_ = false;
  bool media_on_way_ = false;
  size_t control_count_ = 0;
};

}  // namespace

extern "C" int FUZZ_ENTRY(session_flow)(const uint8_t* data, size_t size) {
  FuzzInput input(data, size);
  SessionGame game;
  for (int i = 0; i < kMostSteps && !input.is_empty(); ++i) {
    const auto kind = static_cast<Step>(input.take<uint8_t>() % kStepKinds);
    game.step(kind, input);
  }
  return 0;
}

}  // namespace strandcast::session_flow_fuzz
