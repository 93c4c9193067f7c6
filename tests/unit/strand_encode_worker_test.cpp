#include "server/encode/strand_encode_worker.h"

#include <atomic>
#include <condition_variable>
#include <future>
#include <map>
#include <random>
#include <thread>

#include "common/base/profile.h"
#include "common/strands/strand_prefix.h"
#include "tests/support/eventually.h"

namespace strandcast::strand_encode_worker_test {
namespace {

constexpr uint32_t kStrands = 6;
constexpr uint32_t kVertices = 4;

std::shared_ptr<const Snapshot> make_state(uint64_t tick) {
  auto snapshot = std::make_shared<Snapshot>();
  snapshot->tick = tick;
  snapshot->sim_time_ns = static_cast<int64_t>(tick) * 1000;
  snapshot->strand_count = kStrands;
  snapshot->vertex_count = kVertices;
  snapshot->quantum_m = 1e-4f;
  for (uint32_t i = 0; i < 3 * kStrands * kVertices; ++i)
    snapshot->lattice.push_back(static_cast<int32_t>(i * 100 + (tick * (i + 1)) % 17));
  return snapshot;
}

/// Keeps the frames that a worker gives.
class FrameList {
 public:
  StrandEncodeWorker::Sink sink() {
    return [this](EncodedFramePtr frame) {
      const std::lock_guard lock(mutex_);
      frames_.push_back(std::move(frame));
    };
  }
  std::vector<EncodedFramePtr> frames() const {
    const std::lock_guard lock(mutex_);
    return frames_;
  }
  size_t count() const { return frames().size(); }

 private:
  mutable std::mutex mutex_;
  std::vector<EncodedFramePtr> frames_;
};

/// Writes the tick as payload; can be held inside encode() and can refuse.
class FakeEncoder : public StrandEncoder {
 public:
  struct Control {
    std::mutex mutex;
    std::condition_variable changed;
    bool is_held = false;
    bool is_inside = false;
    bool is_refusing = false;
    bool is_telling = false;  // keyframes tell what the simulation takes over
    std::vector<uint64_t> ticks;

    void hold() {
      const std::lock_guard lock(mutex);
      is_held = true;
    }
    void release() {
      const std::lock_guard lock(mutex);
      is_held = false;
      changed.notify_all();
    }
    bool inside() {
      const std::lock_guard lock(mutex);
      return is_inside;
    }
    std::vector<uint64_t> seen() {
      const std::lock_guard lock(mutex);
      return ticks;
    }
  };

  explicit FakeEncoder(std::shared_ptr<Control> control) : control_(std::move(control)) {}

  EncodedFramePtr encode(const Snapshot& snapshot) override {
    std::unique_lock lock(control_->mutex);
    control_->ticks.push_back(snapshot.tick);
    control_->is_inside = true;
    control_->changed.wait(lock, [&] { return !control_->is_held; });
    control_->is_inside = false;
    if (control_->is_refusing) return nullptr;
    tick_ = snapshot.tick;
    ++sequence_;
    return frame(sequence_ == 1 ? Opcode::StrandKeyframe : Opcode::StrandDelta);
  }
  JoinFrames encode_for_join(const Snapshot& snapshot) override {
    const EncodedFramePtr encoded = encode(snapshot);
    const bool is_first = sequence_ == 1;
    if (control_->is_telling) {
      told_ = std::make_shared<SharedUpdate>();
      told_->is_told = true;
    }
    return {encoded, encoded == nullptr || is_first ? encoded : frame(Opcode::StrandKeyframe)};
  }
  std::shared_ptr<SharedUpdate> take_shared(SharedStates which) override {
    return which == SharedStates::None ? nullptr : std::exchange(told_, nullptr);
  }

 private:
  EncodedFramePtr frame(Opcode opcode) const {
    FrameHeader header;
    header.opcode = opcode;
    header.sequence = sequence_;
    header.base_sequence = opcode == Opcode::StrandDelta ? sequence_ - 1 : 0;
    return make_encoded_frame(header, std::as_bytes(std::span(&tick_, 1)));
  }

  std::shared_ptr<Control> control_;
  std::shared_ptr<SharedUpdate> told_;
  uint64_t tick_ = 0;
  uint32_t sequence_ = 0;
};

class StrandEncoding : public testing::Test {
 protected:
  StrandEncoding() : control_(std::make_shared<FakeEncoder::Control>()) {}
  std::unique_ptr<StrandEncodeWorker> start() {
    return std::make_unique<StrandEncodeWorker>(slot_, std::make_unique<FakeEncoder>(control_), list_.sink());
  }

  SnapshotSlot slot_;
  std::shared_ptr<FakeEncoder::Control> control_;
  FrameList list_;
};

TEST_F(StrandEncoding, NothingIsEncodedWhileNobodyListens) {
  const auto worker = start();
  for (uint64_t tick = 1; tick <= 5; ++tick) slot_.put(make_state(tick));
  worker->request_keyframe();
  give_time_to_misbehave();
  EXPECT_EQ(worker->counters().encodes, 0u);
  worker->set_listeners(StrandListeners::All);
  ASSERT_TRUE(eventually([&] { return list_.count() >= 1; }));
  EXPECT_EQ(list_.frames()[0]->header.opcode, Opcode::StrandKeyframe);
  EXPECT_EQ(control_->seen(), std::vector<uint64_t>{5}) << "only the newest state";
}

TEST_F(StrandEncoding, AfterAPauseTheChainGoesOnWithAKeyframe) {
  const auto worker = start();
  worker->set_listeners(StrandListeners::All);
  slot_.put(make_state(1));
  ASSERT_TRUE(eventually([&] { return list_.count() == 1; }));
  worker->set_listeners(StrandListeners::None);
  slot_.put(make_state(2));
  slot_.put(make_state(3));
  give_time_to_misbehave();
  EXPECT_EQ(list_.count(), 1u);
  worker->set_listeners(StrandListeners::All);
  ASSERT_TRUE(eventually([&] { return list_.count() >= 2; }));
  const auto frame = list_.frames()[1];
  EXPECT_EQ(frame->header.opcode, Opcode::StrandKeyframe) << "a delta would be of use to nobody";
  EXPECT_EQ(frame->header.sequence, 2u);
  slot_.put(make_state(4));
  ASSERT_TRUE(eventually([&] { return list_.count() == 3; }));
  EXPECT_EQ(list_.frames()[2]->header.base_sequence, 2u);
}

TEST_F(StrandEncoding, WhoDrawsPicturesGetsTheStatesThatItAsksFor) {
  const auto worker = start();
  worker->set_listeners(StrandListeners::OnRequest);
  slot_.put(make_state(1));
  ASSERT_TRUE(eventually([&] { return list_.count() == 1; })) << "to begin with";
  EXPECT_EQ(list_.frames()[0]->header.opcode, Opcode::StrandKeyframe);
  for (uint64_t tick = 2; tick <= 4; ++tick) slot_.put(make_state(tick));
  constexpr int64_t kHourNs = 3'600'000'000'000;
  worker->request_state(now_ns() + kHourNs);
  give_time_to_misbehave();
  EXPECT_EQ(list_.count(), 1u) << "not asked for, or not yet";
  worker->request_state(now_ns());
  ASSERT_TRUE(eventually([&] { return list_.count() == 2; }));
  slot_.put(make_state(5));
  give_time_to_misbehave();
  EXPECT_EQ(control_->seen(), (std::vector<uint64_t>{1, 4})) << "the newest, once";
  EXPECT_EQ(list_.frames()[1]->header.base_sequence, list_.frames()[0]->header.sequence);
  // One that comes before there is a newer state gets the next.
  worker->request_state(now_ns());
  ASSERT_TRUE(eventually([&] { return list_.count() == 3; }));
  worker->request_state(now_ns());
  give_time_to_misbehave();
  EXPECT_EQ(list_.count(), 3u) << "the scene is paused";
  slot_.put(make_state(6));
  ASSERT_TRUE(eventually([&] { return list_.count() == 4; }));
  EXPECT_EQ(control_->seen(), (std::vector<uint64_t>{1, 4, 5, 6}));
}

// The last one before a pause, or of counted steps, is asked for ahead of its time, and nothing follows it.
TEST_F(StrandEncoding, AStateThatIsAskedForAheadComesThoughNoneFollows) {
  const auto worker = start();
  worker->set_listeners(StrandListeners::OnRequest);
  slot_.put(make_state(1));
  ASSERT_TRUE(eventually([&] { return list_.count() == 1; }));
  give_time_to_misbehave();  // it waits, and nobody has asked
  constexpr int64_t kAheadNs = 50'000'000;
  worker->request_state(now_ns() + kAheadNs);
  slot_.put(make_state(2));
  ASSERT_TRUE(eventually([&] { return list_.count() == 2; }));
  EXPECT_EQ(control_->seen(), (std::vector<uint64_t>{1, 2}));
}

TEST_F(StrandEncoding, AKeyframeComesWithTheNewestStateThoughNobodyAskedForThat) {
  const auto worker = start();
  worker->set_listeners(StrandListeners::OnRequest);
  slot_.put(make_state(1));
  ASSERT_TRUE(eventually([&] { return list_.count() == 1; }));
  slot_.put(make_state(2));
  worker->request_keyframe();
  ASSERT_TRUE(eventually([&] { return list_.count() == 3; })) << "a delta and a keyframe";
  EXPECT_EQ(list_.frames()[2]->header.opcode, Opcode::StrandKeyframe);
  EXPECT_EQ(control_->seen(), (std::vector<uint64_t>{1, 2}));
}

TEST_F(StrandEncoding, ARequestStandsUntilAFrameAnswersIt) {
  const auto worker = start();
  worker->set_listeners(StrandListeners::OnRequest);
  slot_.put(make_state(1));
  ASSERT_TRUE(eventually([&] { return list_.count() == 1; }));
  {
    const std::lock_guard lock(control_->mutex);
    control_->is_refusing = true;
  }
  worker->request_state(now_ns());
  slot_.put(make_state(2));
  ASSERT_TRUE(eventually([&] { return worker->counters().too_large == 1; }));
  {
    const std::lock_guard lock(control_->mutex);
    control_->is_refusing = false;
  }
  slot_.put(make_state(3));
  ASSERT_TRUE(eventually([&] { return list_.count() == 2; }));
  // Whoever reads every state gets every state, asked for or not.
  worker->set_listeners(StrandListeners::All);
  slot_.put(make_state(4));
  ASSERT_TRUE(eventually([&] { return list_.count() == 3; }));
}

TEST_F(StrandEncoding, RequestsBetweenTwoTicksShareOneKeyframe) {
  const auto worker = start();
  worker->set_listeners(StrandListeners::All);
  slot_.put(make_state(1));
  ASSERT_TRUE(eventually([&] { return list_.count() == 1; }));
  control_->hold();
  slot_.put(make_state(2));
  ASSERT_TRUE(eventually([&] { return control_->inside(); }));
  std::vector<std::thread> joiners;
  for (int i = 0; i < 8; ++i) joiners.emplace_back([&] { worker->request_keyframe(); });
  for (std::thread& joiner : joiners) joiner.join();  // returns although the encoder is busy
  const uint64_t keyframes_before = worker->counters().keyframes;
  control_->release();
  slot_.put(make_state(3));
  ASSERT_TRUE(eventually([&] { return list_.count() == 4; })) << "keyframe 1, deltas 2 and 3, keyframe 3";
  give_time_to_misbehave();
  EXPECT_EQ(worker->counters().keyframes, keyframes_before + 1);
  EXPECT_EQ(worker->counters().encodes, 3u) << "the keyframe comes with the next state's encode";
  EXPECT_EQ(list_.count(), 4u);
}

// Everybody takes a keyframe's state over, and each time hair moves a little.
TEST_F(StrandEncoding, RequestsWithinHalfASecondShareAKeyframeThatIsTakenOver) {
  constexpr uint64_t kFrames = 61, kPerHalfSecond = 30;
  for (const bool is_telling : {false, true}) {
    control_->is_telling = is_telling;
    SharedSlot shared;
    shared.set_wanted(SharedStates::All);
    SnapshotSlot slot;
    FrameList list;
    StrandEncodeWorker worker(slot, std::make_unique<FakeEncoder>(control_), list.sink(), {}, &shared);
    worker.set_listeners(StrandListeners::All);
    for (uint64_t tick = 0; tick < kFrames; ++tick) {
      const size_t before = worker.counters().encodes;
      auto state = std::make_shared<Snapshot>(*make_state(tick + 1));
      state->sim_time_ns = static_cast<int64_t>(tick) * 500'000'000 / kPerHalfSecond;
      worker.request_keyframe();
      slot.put(state);
      ASSERT_TRUE(eventually([&] { return worker.counters().encodes > before; }));
    }
    const uint64_t keyframes = worker.counters().keyframes;
    // A request may come while the keyframe before it is still the newest.
    EXPECT_TRUE(is_telling ? keyframes == 3 : keyframes > kFrames / 2) << keyframes;
    // One more comes where no states do.
    const size_t count = list.count();
    worker.request_keyframe();
    EXPECT_TRUE(eventually([&] { return list.count() > count; }));
  }
}

// A simulation that counts its steps goes on from the same keyframes, however slow the encoder is.
TEST_F(StrandEncoding, WhoCountsStepsWaitsUntilAStateIsEncoded) {
  SharedSlot shared;
  SnapshotSlot slot;
  FrameList list;
  StrandEncodeWorker worker(slot, std::make_unique<FakeEncoder>(control_), list.sink(), {}, &shared);
  shared.wait_encoded(7);  // nobody follows
  worker.set_listeners(StrandListeners::All);
  control_->hold();
  slot.put(make_state(7));
  ASSERT_TRUE(eventually([&] { return control_->inside(); }));
  auto waiting = std::async(std::launch::async, [&] {
    shared.wait_encoded(7);
    return list.count();
  });
  give_time_to_misbehave();
  control_->release();
  EXPECT_EQ(waiting.get(), 1u);
}

TEST_F(StrandEncoding, AJoinerOfAPausedSceneGetsThePresentStateEncodedAgain) {
  const auto worker = start();
  worker->set_listeners(StrandListeners::All);
  slot_.put(make_state(1));
  ASSERT_TRUE(eventually([&] { return list_.count() == 1; }));
  slot_.put(make_state(2));
  ASSERT_TRUE(eventually([&] { return list_.count() == 2; }));
  worker->request_keyframe();
  ASSERT_TRUE(eventually([&] { return list_.count() == 4; }));
  const auto frames = list_.frames();
  EXPECT_EQ(frames[2]->header.opcode, Opcode::StrandDelta);
  EXPECT_EQ(frames[3]->header.opcode, Opcode::StrandKeyframe);
  EXPECT_EQ(frames[3]->header.sequence, frames[2]->header.sequence);
  EXPECT_EQ(control_->seen(), (std::vector<uint64_t>{1, 2, 2}));
}

TEST_F(StrandEncoding, ALateRequestForTheSameStateGetsTheSameKeyframeAgain) {
  const auto worker = start();
  worker->set_listeners(StrandListeners::All);
  slot_.put(make_state(1));
  ASSERT_TRUE(eventually([&] { return list_.count() == 1; }));
  worker->request_keyframe();
  ASSERT_TRUE(eventually([&] { return list_.count() == 2; })) << "also while the simulation is paused";
  EXPECT_EQ(worker->counters().keyframes, 1u);
  EXPECT_EQ(list_.frames()[1]->header.sequence, 1u);
}

TEST_F(StrandEncoding, ASlowEncoderSkipsToTheNewestState) {
  const auto worker = start();
  worker->set_listeners(StrandListeners::All);
  control_->hold();
  slot_.put(make_state(1));
  ASSERT_TRUE(eventually([&] { return control_->inside(); }));
  for (uint64_t tick = 2; tick <= 50; ++tick) slot_.put(make_state(tick));
  control_->release();
  ASSERT_TRUE(eventually([&] { return list_.count() == 2; }));
  EXPECT_EQ(control_->seen(), (std::vector<uint64_t>{1, 50}));
}

TEST_F(StrandEncoding, AStateThatFitsNoMessageIsSkippedAndCounted) {
  const auto worker = start();
  worker->set_listeners(StrandListeners::All);
  control_->is_refusing = true;
  slot_.put(make_state(1));
  ASSERT_TRUE(eventually([&] { return worker->counters().too_large == 1; }));
  {
    const std::lock_guard lock(control_->mutex);
    control_->is_refusing = false;
  }
  slot_.put(make_state(2));
  ASSERT_TRUE(eventually([&] { return list_.count() == 1; }));
}

TEST_F(StrandEncoding, StopsWhileIdleAndWithTheSlot) {
  { const auto worker = start(); }
  const auto worker = start();
  worker->set_listeners(StrandListeners::All);
  slot_.stop();
  slot_.put(make_state(1));
  give_time_to_misbehave();
  EXPECT_EQ(list_.count(), 0u);
}

TEST_F(StrandEncoding, CountsBytesAndStampsTheSendTime) {
  const int64_t begin_ns = now_ns();
  const auto worker = start();
  worker->set_listeners(StrandListeners::All);
  slot_.put(make_state(1));
  ASSERT_TRUE(eventually([&] { return list_.count() == 1; }));
  slot_.put(make_state(2));
  ASSERT_TRUE(eventually([&] { return list_.count() == 2; }));
  const auto frames = list_.frames();
  for (const EncodedFramePtr& frame : frames) {
    const auto header = unpack_frame_header(frame->message);
    ASSERT_TRUE(header);
    EXPECT_EQ(*header, frame->header);
    EXPECT_GE(header->send_time_ns, begin_ns);
    EXPECT_LE(header->send_time_ns, now_ns());
  }
  const StrandEncodeCounters counters = worker->counters();
  EXPECT_EQ(counters.keyframe_bytes, frames[0]->message.size());
  EXPECT_EQ(counters.delta_bytes, frames[1]->message.size());
}

/// Whoever starts at any keyframe of a busy stream decodes everything after it to the published states.
TEST(StrandClassEncoding, EncodesOneStateInSoManySteps) {
  SnapshotSlot slot;
  FrameList frames;
  auto control = std::make_shared<FakeEncoder::Control>();
  StrandEncodeWorker worker(slot, std::make_unique<FakeEncoder>(control), frames.sink(), {3, 4, 1});
  worker.set_listeners(StrandListeners::All);
  uint64_t wanted = 0;
  for (uint64_t tick = 2; tick <= 13; ++tick) {
    slot.put(make_state(tick));
    const bool is_turn = tick == 2 || tick % 4 == 0;
    wanted += is_turn ? 1 : 0;
    if (!is_turn) give_time_to_misbehave();
    ASSERT_TRUE(eventually([&] { return frames.count() == wanted; })) << tick;
  }
  EXPECT_EQ(control->seen(), (std::vector<uint64_t>{2, 4, 8, 12}));
  for (const auto& frame : frames.frames()) EXPECT_EQ(unpack_frame_header(frame->message)->stream_id, 3u);
  // A paused simulation: the newest state is shown although its turn will never come.
  slot.put(make_state(14));
  EXPECT_TRUE(eventually([&] { return control->seen().back() == 14; }));
}

/// States as a viewer of the "raw" codec has them.
std::vector<std::shared_ptr<const Snapshot>> decoded(const FrameList& frames) {
  const auto decoder = std::move(*make_strand_decoder("raw", {kStrands, kVertices}));
  std::vector<std::shared_ptr<const Snapshot>> states;
  for (const EncodedFramePtr& frame : frames.frames()) {
    auto state = decoder->decode(frame->message);
    EXPECT_TRUE(state) << state.error().to_string();
    if (state) states.push_back(*state);
  }
  return states;
}

TEST(StrandClassEncoding, CodesTheFirstStrandsAndCoarsensThem) {
  SnapshotSlot slot;
  FrameList frames;
  StrandEncodeWorker worker(slot, std::move(*make_strand_encoder("raw")), frames.sink(), {2, 1, 3, 0.5f});
  worker.set_listeners(StrandListeners::All);
  const auto state = make_state(4);
  slot.put(state);
  ASSERT_TRUE(eventually([&] { return frames.count() == 1; }));
  const auto sent = decoded(frames);
  ASSERT_EQ(sent.size(), 1u);
  EXPECT_EQ(state_hash(*sent[0]), state_hash(coarsen(prefix_of(*state, kStrands / 2), 3)));
}

// What was announced is what is coded: nothing of the old lattice after a change, and a keyframe first.
TEST(StrandClassEncoding, AChangeLeavesStatesOfTheOldLatticeOut) {
  SnapshotSlot slot;
  FrameList frames;
  StrandEncodeWorker worker(slot, std::move(*make_strand_encoder("delta")), frames.sink(),
                            {0, 1, 1, 1.0f, 1e-4f});
  worker.set_listeners(StrandListeners::All);
  slot.put(make_state(1));
  ASSERT_TRUE(eventually([&] { return frames.count() == 1; }));
  worker.change({0, 1, 1, 0.5f, 2e-4f});
  slot.put(make_state(2));
  worker.request_keyframe();
  give_time_to_misbehave();
  EXPECT_EQ(frames.count(), 1u) << "a state on the old lattice";
  Snapshot other = *make_state(3);
  other.quantum_m = 2e-4f;
  slot.put(std::make_shared<const Snapshot>(other));
  ASSERT_TRUE(eventually([&] { return frames.count() >= 2; }));
  const auto frame = frames.frames()[1];
  EXPECT_EQ(frame->header.opcode, Opcode::StrandKeyframe);
  const auto decoder = std::move(*make_strand_decoder("delta", {kStrands, kVertices}));
  const auto state = decoder->decode(frame->message);
  ASSERT_TRUE(state) << state.error().to_string();
  EXPECT_EQ(state_hash(**state), state_hash(prefix_of(other, kStrands / 2)));
}

TEST(Coarsen, RoundsToTheNearestPointOfTheCoarserLattice) {
  Snapshot fine = *make_state(1);
  for (size_t i = 0; i < fine.lattice.size(); ++i)
    fine.lattice[i] = static_cast<int32_t>(i * 7919 % 2'001) - 1'000;
  for (const uint32_t factor : {1u, 2u, 3u, 4u, 9u, 24u}) {
    const Snapshot coarse = coarsen(fine, factor);
    EXPECT_FLOAT_EQ(coarse.quantum_m, fine.quantum_m * static_cast<float>(factor));
    for (size_t i = 0; i < fine.lattice.size(); ++i)
      EXPECT_LE(2 * std::abs(coarse.lattice[i] * static_cast<int32_t>(factor) - fine.lattice[i]),
                static_cast<int32_t>(factor))
          << fine.lattice[i] << " by " << factor;
  }
}

TEST(StrandEncodingWithCodec, EveryKeyframeIsAWayIntoTheChain) {
  for (const char* codec : {"delta", "raw", "tangent"}) {
    auto encoder = make_strand_encoder(codec);
    ASSERT_TRUE(encoder);
    SnapshotSlot slot;
    FrameList list;
    StrandEncodeWorker worker(slot, std::move(encoder).value(), list.sink());
    worker.set_listeners(StrandListeners::All);
    std::atomic<bool> is_done{false};
    std::thread joiner([&] {
      std::mt19937 random(5);
      while (!is_done) {
        worker.request_keyframe();
        std::this_thread::sleep_for(std::chrono::microseconds(random() % 400));
      }
    });
    constexpr uint64_t kTicks = 300;
    for (uint64_t tick = 1; tick <= kTicks; ++tick) {
      slot.put(make_state(tick));
      std::this_thread::sleep_for(std::chrono::microseconds(100));
    }
    is_done = true;
    joiner.join();
    std::map<uint32_t, uint64_t> hash_of;  // by sequence: the same for everybody
    const auto frames_reach_the_end = [&] {
      const auto frames = list.frames();
      return !frames.empty() && frames.back()->header.sim_time_ns == static_cast<int64_t>(kTicks) * 1000;
    };
    ASSERT_TRUE(eventually(frames_reach_the_end)) << codec;
    const auto frames = list.frames();
    int starts = 0;
    for (size_t start = 0; start < frames.size(); ++start) {
      if (frames[start]->header.opcode != Opcode::StrandKeyframe) continue;
      if (++starts > 40) break;
      auto decoder = make_strand_decoder(codec, {kStrands, kVertices});
      ASSERT_TRUE(decoder);
      uint32_t sequence = 0;
      for (size_t i = start; i < frames.size(); ++i) {
        // A session ignores keyframes while its own chain is whole.
        if (i > start && frames[i]->header.sequence == sequence) continue;
        ASSERT_EQ(frames[i]->header.sequence, i == start ? frames[i]->header.sequence : sequence + 1);
        const auto snapshot = (*decoder)->decode(frames[i]->message);
        ASSERT_TRUE(snapshot) << codec << ": " << snapshot.error().to_string();
        sequence = frames[i]->header.sequence;
        const uint64_t hash = state_hash(**snapshot);
        EXPECT_EQ(hash_of.emplace(sequence, hash).first->second, hash);
        if (std::string_view(codec) != "tangent") {  // the others give back what was published
          EXPECT_EQ(hash, state_hash(*make_state((*snapshot)->tick)));
        }
      }
      EXPECT_EQ(sequence, frames.back()->header.sequence);
    }
    EXPECT_GT(starts, 1) << "no late joiner was ever served";
  }
}

}  // namespace
}  // namespace strandcast::strand_encode_worker_test
