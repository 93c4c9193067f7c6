// Flow control of pictures against a link on paper: the ladder of a view, tiles or video, and a bottleneck
// with a queue. Time is counted, not waited for.
#include <algorithm>
#include <cmath>
#include <deque>
#include <map>

#include "common/base/units.h"
#include "server/encode/picture_encoder.h"
#include "server/encode/picture_ladder.h"
#include "server/net/flow_control.h"
#include "server/net/send_queue.h"

namespace strandcast::picture_flow_test {
namespace {
constexpr double kRateHz = 15.0;
constexpr int kUsualQuality = 80;
constexpr size_t kBestBytes = 40'000;        // of a picture of 640 x 360 in motion, quality 95
constexpr int64_t kPingIntervalNs = kSInNs;  // as a session asks for the bare round trip
constexpr double kWholeFactor = 1.5;  // all tiles against those that changed; a video keyframe needs more

/// A picture without pixels: of a given size, and like tiles or like video.
class PaperPicture : public Picture {
 public:
  PaperPicture(PictureCodec codec, FrameHeader header, size_t bytes)
      : codec_(codec), header_(header), bytes_(bytes) {}
  uint32_t sequence() const override { return header_.sequence; }
  bool can_follow(uint32_t base) const override {
    if (codec_ == PictureCodec::JpegTiles) return base != header_.sequence;
    return header_.base_sequence == 0 || base == header_.base_sequence;
  }
  EncodedFramePtr after(uint32_t base) const override {
    auto frame = std::make_shared<EncodedFrame>();
    frame->header = header_;
    frame->header.base_sequence = codec_ == PictureCodec::JpegTiles ? base : header_.base_sequence;
    // A viewer that missed some needs more tiles than the last change.
    const bool is_next = frame->header.base_sequence + 1 == header_.sequence;
    frame->message.resize(is_next ? bytes_ : static_cast<size_t>(kWholeFactor * static_cast<double>(bytes_)));
    return frame;
  }
  size_t message_bytes() const override { return bytes_; }

 private:
  PictureCodec codec_;
  FrameHeader header_;
  size_t bytes_;
};

/// One viewer: what Session and FrameWorker do, and a link that delivers in order.
class Viewer {
 public:
  Viewer(PictureCodec codec, double link_bytes_per_s, int64_t round_trip_ms)
      : codec_(codec),
        link_bytes_per_s_(link_bytes_per_s),
        round_trip_ns_(round_trip_ms * kMsInNs),
        ladder_(make_picture_ladder(codec, kUsualQuality)) {
    step = find_step(ladder_, kUsualQuality);
    flow_.expect_acks();
    flow_.on_round_trip(round_trip_ns_, time_ns);
    queue_.start_pictures();
  }

  void run(int64_t duration_ns) {
    for (const int64_t end_ns = time_ns + duration_ns; time_ns < end_ns; time_ns += kMsInNs) tick();
  }

  double rate_hz(int64_t from_ns) const {
    const auto count = std::count_if(arrivals_.begin(), arrivals_.end(),
                                     [&](const Arrival& one) { return one.arrived_ns >= from_ns; });
    return static_cast<double>(count) * 1e9 / static_cast<double>(time_ns - from_ns);
  }
  int64_t worst_age_ns(int64_t from_ns) const {
    int64_t worst_ns = 0;
    for (const Arrival& one : arrivals_)
      if (one.arrived_ns >= from_ns) worst_ns = std::max(worst_ns, one.arrived_ns - one.made_ns);
    return worst_ns;
  }

  int64_t time_ns = kSInNs;
  size_t step = 0;
  size_t changes = 0;
  size_t keyframes = 0;
  double most_capacity_bytes_per_s = 0.0;  // that was believed

 private:
  struct Arrival {
    int64_t made_ns, arrived_ns;
  };
  struct OnItsWay {
    EncodedFramePtr frame;
    int64_t ack_ns;
  };

  void tick() {
    while (!on_its_way_.empty() && on_its_way_.front().ack_ns <= time_ns) take_ack();
    const auto interval_ns = static_cast<int64_t>(1e9 / kRateHz) * ladder_[step].rate_divisor;
    if (time_ns >= made_ns_ + interval_ns) offer(0);
    const bool wants_keyframe = codec_ == PictureCodec::Vp8 && queue_.needs_picture() &&
                                flow_.may_start(time_ns) && time_ns >= keyframe_ns_ + kKeyframePauseNs;
    if (wants_keyframe) offer(1);
    if (time_ns % (50 * kMsInNs) == 0) adapt();
    ping();
    most_capacity_bytes_per_s = std::max(most_capacity_bytes_per_s, flow_.capacity_bytes_per_s(time_ns));
    pump();
  }

  /// Waits behind what is on its way, as all that goes over a reliable link.
  void ping() {
    if (pong_ns_ != 0 && time_ns >= pong_ns_) {
      flow_.on_round_trip(pong_ns_ - ping_ns_, time_ns);
      pong_ns_ = 0;
    }
    if (pong_ns_ != 0 || time_ns < ping_ns_ + kPingIntervalNs) return;
    ping_ns_ = time_ns;
    pong_ns_ = std::max(free_ns_, time_ns) + round_trip_ns_;
  }

  double cost(size_t of_step) const {
    return static_cast<double>(kBestBytes) * kRateHz * ladder_[of_step].relative_cost;
  }

  void offer(size_t keyframe) {
    if (keyframe == 0) made_ns_ = time_ns;
    FrameHeader header;
    header.opcode = codec_ == PictureCodec::Vp8 ? Opcode::Vp8Frame : Opcode::JpegTiles;
    header.stream_id = kPictureStreamBit;
    header.base_sequence = keyframe != 0 ? 0 : sequence_;
    header.sequence = ++sequence_;
    if (keyframe != 0) keyframe_ns_ = time_ns;
    keyframes += keyframe;
    const double bytes = cost(step) * ladder_[step].rate_divisor / kRateHz;
    const uint64_t dropped = queue_.dropped_frames();
    made_of_[header.sequence] = time_ns;
    (void)queue_.offer_picture(
        std::make_shared<const PaperPicture>(codec_, header, static_cast<size_t>(bytes)));
    if (queue_.dropped_frames() == dropped) return;
    flow_.on_chain_loss(time_ns);
    adapt();
  }

  void adapt() {
    std::vector<double> costs;
    for (size_t i = 0; i < ladder_.size(); ++i) costs.push_back(cost(i));
    const size_t chosen = flow_.choose_class({step, costs}, time_ns);
    if (chosen == step) return;
    step = chosen;
    ++changes;
    queue_.start_pictures();
    keyframe_ns_ = -kSInNs;  // another class
  }

  void pump() {
    while (auto item = queue_.take_next(flow_.may_send(time_ns) ? SendQueue::Media::Allowed
                                                                : SendQueue::Media::Held)) {
      const auto sent = std::get<EncodedFramePtr>(*item);
      flow_.on_sent(sent->header, sent->message.size(), time_ns);
      queue_.written();
      free_ns_ = std::max(free_ns_, time_ns) +
                 static_cast<int64_t>(static_cast<double>(sent->message.size()) / link_bytes_per_s_ * 1e9);
      on_its_way_.push_back({sent, free_ns_ + round_trip_ns_});
    }
  }

  void take_ack() {
    const FrameHeader header = on_its_way_.front().frame->header;
    on_its_way_.pop_front();
    flow_.on_ack(header.stream_id, header.sequence, time_ns);
    arrivals_.push_back({made_of_[header.sequence], time_ns - round_trip_ns_ / 2});
    adapt();
  }

  const PictureCodec codec_;
  const double link_bytes_per_s_;
  const int64_t round_trip_ns_;
  const std::vector<PictureStep> ladder_;
  FlowControl flow_;
  SendQueue queue_;
  std::deque<OnItsWay> on_its_way_;
  std::deque<Arrival> arrivals_;
  std::map<uint32_t, int64_t> made_of_;
  int64_t made_ns_ = 0, free_ns_ = 0, keyframe_ns_ = -kSInNs;
  int64_t ping_ns_ = 0, pong_ns_ = 0;  // pong 0: none is under way
  uint32_t sequence_ = 0;
};

constexpr double kMbit = 1e6 / 8.0;

TEST(PictureFlow, AFastLinkGetsTheBestQuality) {
  for (const PictureCodec codec : {PictureCodec::JpegTiles, PictureCodec::Vp8})
    for (const int64_t round_trip_ms : {1, 50, 150, 300}) {
      Viewer viewer(codec, 100.0 * kMbit, round_trip_ms);
      viewer.run(30 * kSInNs);
      EXPECT_EQ(viewer.step, 0u) << to_string(codec) << ", " << round_trip_ms << " ms";
      EXPECT_GE(viewer.rate_hz(2 * kSInNs), 0.9 * kRateHz)
          << to_string(codec) << ", " << round_trip_ms << " ms";
      EXPECT_LE(viewer.keyframes, 2u);
    }
}

TEST(PictureFlow, ASlowLinkSettlesWithinThreeSecondsAndStays) {
  for (const PictureCodec codec : {PictureCodec::JpegTiles, PictureCodec::Vp8})
    for (const double mbit : {2.0, 1.0, 0.5}) {
      Viewer viewer(codec, mbit * kMbit, 40);
      viewer.run(3 * kSInNs);
      const std::string what = fmt::format("{} at {} Mbit/s", to_string(codec), mbit);
      EXPECT_GT(viewer.step, 1u) << what;
      const int64_t from_ns = viewer.time_ns;
      viewer.run(57 * kSInNs);
      EXPECT_LE(viewer.changes, 12u) << what;
      EXPECT_GE(viewer.rate_hz(from_ns), 5.0) << what;
      EXPECT_LE(viewer.worst_age_ns(from_ns), 700 * kMsInNs) << what;
      EXPECT_LE(viewer.most_capacity_bytes_per_s, 1.1 * mbit * kMbit) << what << ": more than there is";
    }
}

}  // namespace
}  // namespace strandcast::picture_flow_test
