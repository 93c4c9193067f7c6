// One viewer on paper: what Session does with FlowControl and SendQueue, an encoder per class, and a link
// with a bottleneck, a queue, a delay and freezes. Time is counted, not waited for.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <variant>
#include <vector>

#include "common/base/hash.h"
#include "common/base/units.h"
#include "server/net/flow_control.h"
#include "server/net/send_queue.h"
#include "server/net/strand_class.h"

namespace strandcast::simulated {
inline constexpr int64_t kStepNs = 16'666'667;
/// Sizes of the built-in scene at 0.1 mm with an older codec, which gave more.
inline constexpr double kFullBytesPerS = 6.6e6 / 8.0;
inline constexpr size_t kKeyframeBytes = 124'000;
inline constexpr size_t kAssetBytes = 330'000;
/// Weight of the newest frame in what a class costs, as in the server.
inline constexpr double kCostSmoothing = 0.05;

inline StrandStreamPlan built_in_plan() {
  return {.step_rate_hz = 60.0, .bound_m = 1e-4f, .strand_count = 2'000};
}

/// Classes of such a codec: nothing in a frame is fixed.
inline constexpr StrandByteModel kSimulatedBytes = {0.0, 0.0, 0.95, 0.54, 0.63};

/// Bytes per second of a class against those of the first.
inline double relative_cost(const StrandClass& row) {
  const StrandClass first = make_strand_classes(built_in_plan()).front();
  return expected_bytes_per_s(kSimulatedBytes, {first, 1.0 / first.frame_rate_hz}, row);
}

struct Link {
  double bytes_per_s = 1e9;
  int64_t round_trip_ns = 1 * kMsInNs;
  int64_t jitter_ns = 0;
  std::function<bool(int64_t)> is_frozen = [](int64_t) { return false; };
  int64_t reader_ns = 1;  // the client looks this often for what has come
};

/// The machine at its end.
struct Machine {
  int64_t decode_ns = 0;                                                 // of a state with all strands
  std::function<bool(int64_t)> is_away = [](int64_t) { return false; };  // others have the processor
  bool tells_times = true;  // when it receives and how long it decodes
};

/// What the strands take, all of them at 60 Hz.
struct Content {
  double bytes_per_s = kFullBytesPerS;
  size_t keyframe_bytes = kKeyframeBytes;
  size_t asset_bytes = kAssetBytes;
  std::function<double(int64_t)> activity = [](int64_t) { return 1.0; };  // against bytes_per_s
};

/// The built-in scene with the codec `tangent`, as recorded from a server: for 0.4 s in every 12 s the head
/// turns quickly and frames are twice as large; each gust makes ten frames that shrink from 1.4 to 0.8.
inline Content turning_head() {
  return {.bytes_per_s = 5.2e6 / 8.0,
          .keyframe_bytes = 2'000 * 16 * 25 / 16,  // 12.5 bits per vertex
          .asset_bytes = 577'000,
          .activity = [](int64_t time_ns) {
            const bool turns = time_ns % (12 * kSInNs) < 400 * kMsInNs;
            const double gust = static_cast<double>(time_ns / kStepNs % 10) / 9.0;
            return (turns ? 2.0 : 1.0) * (1.4 - 0.6 * gust);
          }};
}

/// One viewer: what Session does with FlowControl and SendQueue, and a link that delivers in order.
class Viewer {
 public:
  explicit Viewer(Link path, Content what = {})
      : link(std::move(path)), content(std::move(what)), classes_(make_strand_classes(built_in_plan())) {
    note_cost(content.bytes_per_s);
    flow.expect_acks();
    queue.set_asset(frame(Opcode::Asset, 1, 0, content.asset_bytes));
    queue.start_strands();
    flow.on_round_trip(link.round_trip_ns, time_ns);
  }

  void run(int64_t duration_ns) {
    for (const int64_t end_ns = time_ns + duration_ns; time_ns < end_ns; time_ns += kMsInNs) tick();
  }

  struct Arrival {
    int64_t made_ns, arrived_ns;
    size_t stream;
    bool is_keyframe;
  };
  std::vector<Arrival> arrivals_since(int64_t from_ns) const {
    std::vector<Arrival> since;
    for (const Arrival& arrival : arrivals)
      if (arrival.arrived_ns >= from_ns) since.push_back(arrival);
    return since;
  }
  double rate_hz(int64_t from_ns) const {
    return static_cast<double>(arrivals_since(from_ns).size()) * 1e9 / static_cast<double>(time_ns - from_ns);
  }
  /// Longest age of a state at its arrival, less what the bare link takes.
  int64_t worst_age_ns(int64_t from_ns) const {
    int64_t worst_ns = 0;
    for (const Arrival& arrival : arrivals_since(from_ns))
      worst_ns = std::max(worst_ns, arrival.arrived_ns - arrival.made_ns - link.round_trip_ns / 2);
    return worst_ns;
  }

  Link link;
  Content content;
  Machine machine;
  FlowControl flow;
  SendQueue queue;
  int64_t time_ns = 1 * kSInNs;
  size_t present = 0;
  size_t changes = 0;
  size_t keyframes = 0;
  bool reads = true;
  double cap_bytes_per_s = 0.0;
  size_t most_in_flight_bytes = 0;
  std::vector<Arrival> arrivals;
  std::map<size_t, std::vector<int64_t>> tries;  // of better classes: when

 private:
  struct OnItsWay {
    EncodedFramePtr frame;
    int64_t ack_ns;
  };
  struct Received {
    EncodedFramePtr frame;
    int64_t received_ns, begun_ns, left_ns;  // of decoding; not begun: 0
  };

  static EncodedFramePtr frame(Opcode opcode, uint32_t sequence, uint16_t stream, size_t bytes) {
    auto made = std::make_shared<EncodedFrame>();
    made->header.opcode = opcode;
    made->header.sequence = sequence;
    made->header.base_sequence = opcode == Opcode::StrandDelta ? sequence - 1 : 0;
    made->header.stream_id = stream;
    made->message.resize(bytes);
    return made;
  }

  /// Of all strands at the full rate; what the classes cost follows.
  void note_cost(double full_bytes_per_s) {
    full_cost_ += (full_cost_ == 0.0 ? 1.0 : kCostSmoothing) * (full_bytes_per_s - full_cost_);
    costs_.clear();
    for (const StrandClass& row : classes_) costs_.push_back(relative_cost(row) * full_cost_);
  }

  void tick() {
    const bool is_looking = time_ns >= looked_ns_ + link.reader_ns && !machine.is_away(time_ns);
    if (is_looking) looked_ns_ = time_ns;
    while (is_looking && reads && !on_its_way_.empty() && on_its_way_.front().ack_ns <= time_ns &&
           !link.is_frozen(time_ns))
      receive();
    if (!machine.is_away(time_ns)) decode(kMsInNs);
    if (time_ns >= next_step_ns_) {
      next_step_ns_ += kStepNs;
      ++step_;
      const uint32_t divisor = classes_[present].rate_divisor;
      if (step_ % divisor == 0) offer(Opcode::StrandDelta);
    }
    if (time_ns % (50 * kMsInNs) == 0) adapt();
    probe();
    pump();
  }

  /// What Session's probe does: a ping a second, which waits in the queue like everything else.
  void probe() {
    if (pong_ns_ > 0 && time_ns >= pong_ns_ && !link.is_frozen(time_ns)) {
      flow.on_round_trip(time_ns - pinged_ns_, time_ns);
      pong_ns_ = 0;
    }
    if (pong_ns_ != 0 || time_ns - pinged_ns_ < kSInNs) return;
    pinged_ns_ = time_ns;
    pong_ns_ = std::max(free_ns_, time_ns) + link.round_trip_ns + late_ns();
  }
  int64_t late_ns() {
    return static_cast<int64_t>(unit_float(mix_u32(++random_)) * static_cast<double>(link.jitter_ns));
  }

  void offer(Opcode opcode) {
    const bool is_keyframe = opcode == Opcode::StrandKeyframe;
    const StrandClass& row = classes_[present];
    const double coarse = (row.coarsening > 1 ? 0.7 : 1.0) * static_cast<double>(row.strand_share);
    const double full_bytes_per_s = content.bytes_per_s * content.activity(time_ns);
    const double delta_bytes = full_bytes_per_s * relative_cost(row) / row.frame_rate_hz;
    // A keyframe brings the state before, and the delta that everybody gets.
    const auto bytes = static_cast<size_t>(
        delta_bytes + (is_keyframe ? coarse * static_cast<double>(content.keyframe_bytes) : 0.0));
    if (!is_keyframe) ++sequence_;
    if (!is_keyframe) note_cost(full_bytes_per_s);
    const auto made = frame(opcode, sequence_, static_cast<uint16_t>(present), bytes);
    made_ns_[made.get()] = time_ns;
    if (queue.offer_strands(made) == SendQueue::Offer::LostChain) {
      flow.on_chain_loss(time_ns);
      adapt();
    }
    keyframes += is_keyframe ? 1 : 0;
  }

  void adapt() {
    const size_t chosen = flow.choose_class({present, costs_, cap_bytes_per_s, classes_}, time_ns);
    if (chosen == present) return;
    if (chosen < present) tries[chosen].push_back(time_ns);
    present = chosen;
    ++changes;
    queue.restart_strands();
  }

  void pump() {
    if (queue.needs_keyframe() && flow.may_start(time_ns) && time_ns >= keyframe_asked_ns_ + 250 * kMsInNs) {
      keyframe_asked_ns_ = time_ns;
      offer(Opcode::StrandKeyframe);
    }
    while (auto item =
               queue.take_next(flow.may_send(time_ns) ? SendQueue::Media::Allowed : SendQueue::Media::Held)) {
      const auto sent = std::get<EncodedFramePtr>(*item);
      flow.on_sent(sent->header, sent->message.size(), time_ns);
      most_in_flight_bytes = std::max(most_in_flight_bytes, flow.in_flight_bytes());
      queue.written();
      free_ns_ = std::max(free_ns_, time_ns) +
                 static_cast<int64_t>(static_cast<double>(sent->message.size()) / link.bytes_per_s * 1e9);
      const int64_t ack_ns = free_ns_ + link.round_trip_ns + late_ns();
      on_its_way_.push_back({sent, std::max(ack_ns, on_its_way_.empty() ? 0 : on_its_way_.back().ack_ns)});
    }
  }

  void receive() {
    const double share = classes_[on_its_way_.front().frame->header.stream_id].strand_share;
    received_.push_back({on_its_way_.front().frame, time_ns, 0,
                         static_cast<int64_t>(share * static_cast<double>(machine.decode_ns))});
    on_its_way_.pop_front();
  }

  void decode(int64_t budget_ns) {
    while (!received_.empty()) {
      Received& first = received_.front();
      if (first.begun_ns == 0) first.begun_ns = time_ns;
      const int64_t spent_ns = std::min(budget_ns, first.left_ns);
      budget_ns -= spent_ns;
      first.left_ns -= spent_ns;
      if (first.left_ns > 0) return;
      acknowledge(first);
      received_.pop_front();
    }
  }

  void acknowledge(const Received& done) {
    constexpr int64_t kClientAheadNs = 5'000 * kSInNs, kLeastDecodeNs = kMsInNs / 10;
    const FrameHeader& header = done.frame->header;
    ClientTimes client;
    if (machine.tells_times)
      client = {time_of_receipt_ns(done) + kClientAheadNs, std::max(time_ns - done.begun_ns, kLeastDecodeNs)};
    flow.on_ack(header.stream_id, header.sequence, time_ns, client);
    if (header.opcode != Opcode::Asset)
      arrivals.push_back({made_ns_[done.frame.get()], time_ns - link.round_trip_ns / 2, header.stream_id,
                          header.opcode == Opcode::StrandKeyframe});
    adapt();
  }

  int64_t time_of_receipt_ns(const Received& done) {
    told_ns_ = std::max(told_ns_ + 1, done.received_ns);
    return told_ns_;
  }

  std::vector<StrandClass> classes_;
  std::vector<double> costs_;
  double full_cost_ = 0.0;
  int64_t looked_ns_ = 0;
  std::deque<OnItsWay> on_its_way_;
  std::deque<Received> received_;
  int64_t told_ns_ = 0;
  std::map<const EncodedFrame*, int64_t> made_ns_;
  int64_t pinged_ns_ = 0, pong_ns_ = 0, next_step_ns_ = 0, free_ns_ = 0, keyframe_asked_ns_ = -kSInNs;
  uint64_t step_ = 0;
  uint32_t sequence_ = 0, random_ = 0;
};

}  // namespace strandcast::simulated
