#include "common/replay/strand_replay.h"
#include "common/base/units.h"

#include "tests/support/hair_motion.h"

namespace strandcast::strand_replay_test {
namespace {

constexpr uint32_t kStrands = 30;
constexpr uint32_t kVertices = 8;
constexpr float kQuantumM = 1e-4f;
constexpr int64_t kStepNs = 16'666'667;

constexpr StrandStreamLimits kLimits{kStrands, kVertices};

/// A server's strand stream and the replay that follows it, without a network.
class StrandReplayTest : public testing::Test {
 protected:
  void SetUp() override {
    auto replay = StrandReplay::make("delta", kLimits, [this] { ++requests_; });
    ASSERT_TRUE(replay) << replay.error().to_string();
    replay_ = std::move(replay).value();
    auto encoder = make_strand_encoder("delta");
    ASSERT_TRUE(encoder);
    encoder_ = std::move(encoder).value();
  }

  /// Simulates one step and encodes it.
  EncodedFramePtr next() {
    hair_.step();
    truth_ = hair_.snapshot(kQuantumM);
    return encoder_->encode(truth_);
  }
  std::shared_ptr<const Snapshot> receive(const EncodedFramePtr& frame, int64_t receive_time_ns = 0) {
    return replay_->receive(frame->message, receive_time_ns, clock_);
  }

  HairMotion hair_{{.strand_count = kStrands, .vertex_count = kVertices}};
  Snapshot truth_;
  std::unique_ptr<StrandEncoder> encoder_;
  std::unique_ptr<StrandReplay> replay_;
  ClockOffset clock_;
  int requests_ = 0;
};

TEST_F(StrandReplayTest, DecodesTheServersStateBitForBit) {
  uint64_t bytes = 0;
  for (int i = 0; i < 30; ++i) {
    const auto frame = next();
    bytes += frame->message.size();
    const auto snapshot = receive(frame, i * kStepNs);
    ASSERT_TRUE(snapshot);
    EXPECT_EQ(state_hash(*snapshot), state_hash(truth_));
  }
  const ReplayStats& stats = replay_->stats();
  EXPECT_EQ(stats.decoded_frames, 30u);
  EXPECT_EQ(stats.keyframes, 1u);
  EXPECT_EQ(stats.received_bytes, bytes);
  EXPECT_EQ(stats.gaps, 0u);
  EXPECT_EQ(stats.rejected_frames, 0u);
  EXPECT_EQ(requests_, 0);
  EXPECT_EQ(replay_->decode_timer().count(), 30u);
}

TEST_F(StrandReplayTest, LowLatencyShowsTheNewestStateExactly) {
  EXPECT_FALSE(replay_->strands_at(0));
  EXPECT_EQ(replay_->newest(), nullptr);
  for (int i = 0; i < 5; ++i) receive(next(), i * kStepNs);
  const auto strands = replay_->strands_at(4 * kStepNs + 3 * kMsInNs);
  ASSERT_TRUE(strands);
  EXPECT_EQ(strands->position_m, positions_in_head(truth_));
  EXPECT_EQ(strands->world_from_head, truth_.world_from_head);
}

TEST_F(StrandReplayTest, ALostFrameIsAGapAndAsksOnceASecond) {
  receive(next());
  (void)next();  // lost
  for (int i = 0; i < 10; ++i) EXPECT_EQ(receive(next(), i * 150 * kMsInNs), nullptr);
  EXPECT_EQ(replay_->stats().gaps, 1u);
  EXPECT_EQ(replay_->stats().missed_frames, 1u);
  EXPECT_EQ(replay_->stats().rejected_frames, 10u);
  EXPECT_EQ(replay_->stats().wrong_states, 0u);
  EXPECT_EQ(requests_, 2) << "at 0 and at 1.05 s of 1.35 s";
  ASSERT_TRUE(receive(encoder_->encode_for_join(truth_).keyframe));
  ASSERT_TRUE(receive(next()));
  EXPECT_EQ(state_hash(*replay_->newest()), state_hash(truth_));
}

TEST_F(StrandReplayTest, AMalformedFrameChangesNothing) {
  receive(next());
  const auto good = next();
  auto bad = good->message;
  bad.resize(bad.size() / 2);
  EXPECT_EQ(replay_->receive(bad, 0, clock_), nullptr);
  EXPECT_EQ(replay_->receive({}, 0, clock_), nullptr);
  EXPECT_EQ(replay_->stats().rejected_frames, 2u);
  EXPECT_EQ(requests_, 1);
  ASSERT_TRUE(receive(good)) << "the chain goes on where it was";
  EXPECT_EQ(state_hash(*replay_->newest()), state_hash(truth_));
}

// Whoever computes other states than the server's says how often; what follows a refused frame tells nothing.
TEST_F(StrandReplayTest, CountsStatesThatAreNotTheServers) {
  constexpr size_t kHashByte = 32 + 88;  // proto/WIRE.md: header, then the fixed part
  const auto receive_wrong = [&](const EncodedFramePtr& frame) {
    auto wrong = frame->message;
    wrong[kHashByte] ^= std::byte{1};
    EXPECT_EQ(replay_->receive(wrong, 0, clock_), nullptr);
  };
  receive(next());
  receive_wrong(next());
  for (int i = 0; i < 5; ++i) EXPECT_EQ(receive(next()), nullptr);
  EXPECT_EQ(replay_->stats().wrong_states, 1u);
  EXPECT_THAT(replay_->stats().last_error, testing::Not(testing::IsEmpty()));
  receive_wrong(encoder_->encode_for_join(truth_).keyframe);
  EXPECT_EQ(replay_->stats().wrong_states, 2u);
  ASSERT_TRUE(receive(encoder_->encode_for_join(truth_).keyframe));
  ASSERT_TRUE(receive(next()));
  receive_wrong(next());
  EXPECT_EQ(replay_->stats().wrong_states, 3u);
}

TEST_F(StrandReplayTest, RefusesAnUnknownCodec) {
  const auto replay = StrandReplay::make("magic", kLimits, {});
  ASSERT_FALSE(replay);
  EXPECT_EQ(replay.error().code, ErrorCode::NotFound);
}

TEST_F(StrandReplayTest, SmoothPlayoutMovesEvenlyBetweenStates) {
  replay_->set_playout(Playout::Smooth);
  std::vector<Snapshot> truths;
  for (int i = 0; i < 40; ++i) {
    const auto frame = next();
    truths.push_back(truth_);
    // Received unevenly: every other frame 4 ms late.
    ASSERT_TRUE(receive(frame, i * kStepNs + (i % 2) * 4 * kMsInNs));
  }
  const Snapshot& before = truths[truths.size() - 2];
  const Snapshot& newest = truths.back();
  double last = -1.0;
  int between = 0;
  for (int64_t t_ns = 39 * kStepNs; t_ns < 42 * kStepNs; t_ns += kMsInNs) {
    const auto strands = replay_->strands_at(t_ns);
    ASSERT_TRUE(strands);
    // Where the head is on its way from the last state but one to the newest, as a fraction.
    const auto way = newest.world_from_head.position_m - before.world_from_head.position_m;
    const double fraction =
        glm::dot(strands->world_from_head.position_m - before.world_from_head.position_m, way) /
        glm::dot(way, way);
    EXPECT_GE(fraction, last - 1e-9) << "never backwards";
    EXPECT_LE(fraction, 1.0 + 1e-9) << "never beyond what was received";
    last = fraction;
    if (fraction > 0.02 && fraction < 0.98) ++between;
  }
  EXPECT_GE(between, 10) << "a step lasts 16.7 ms, sampled every millisecond";
  EXPECT_NEAR(last, 1.0, 1e-9) << "without news it rests on the newest state";
  EXPECT_GE(replay_->playout_delay_ms(), 16.0);
}

TEST_F(StrandReplayTest, AResetServerIsNotBlendedInto) {
  replay_->set_playout(Playout::Smooth);
  for (int i = 0; i < 10; ++i) receive(next(), i * kStepNs);
  hair_ = HairMotion({.strand_count = kStrands, .vertex_count = kVertices});
  receive(next(), 10 * kStepNs);
  const auto strands = replay_->strands_at(10 * kStepNs);
  ASSERT_TRUE(strands);
  EXPECT_EQ(strands->position_m, positions_in_head(truth_));
}

TEST_F(StrandReplayTest, AnotherStreamStartsWithItsKeyframeAndNeverStepsBack) {
  auto other = make_strand_encoder("delta");
  ASSERT_TRUE(other);
  EncodedFramePtr old_state;
  Snapshot old_truth;
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE(receive(next(), i * kStepNs));
    if (i % 4 != 0) continue;
    old_truth = truth_;
    old_state = with_send_time(*(*other)->encode(truth_), 2, 1);
  }
  const auto newest = replay_->newest();
  // A delta of the other stream whose number fits by chance must not be taken for one of this stream.
  EXPECT_FALSE(receive(old_state, 10 * kStepNs));
  EXPECT_EQ(requests_, 1);
  EXPECT_TRUE(receive(with_send_time(*(*other)->encode_for_join(old_truth).keyframe, 2, 1), 10 * kStepNs));
  EXPECT_EQ(replay_->newest(), newest) << "the keyframe is of an older state";
  for (int i = 10; i < 20; ++i) {
    const auto own = next();
    const auto coarse = with_send_time(*(*other)->encode(truth_), 2, 1);
    EXPECT_FALSE(receive(own, i * kStepNs)) << "a delta of the stream that was left";
    ASSERT_TRUE(receive(coarse, i * kStepNs));
    EXPECT_EQ(state_hash(*replay_->newest()), state_hash(truth_));
  }
  EXPECT_EQ(replay_->stats().gaps, 0u) << "streams count by themselves";
}

// What is still on its way by the old codec is shown, and nothing is refused in between.
TEST_F(StrandReplayTest, AnotherCodecBeginsWithTheKeyframeOfItsStream) {
  for (const char* codec : {"raw", "delta"}) {
    const uint16_t stream_id = std::string(codec) == "raw" ? 256 : 0;
    auto other = make_strand_encoder(codec);
    ASSERT_TRUE(other);
    for (int i = 0; i < 5; ++i)
      ASSERT_TRUE(receive(with_send_time(*next(), replay_->stream_id(), 1), i * kStepNs));
    ASSERT_TRUE(replay_->follow_codec(codec, hair_.rest_in_head()).ok());
    ASSERT_TRUE(receive(with_send_time(*next(), replay_->stream_id(), 1), 5 * kStepNs));
    EXPECT_EQ(state_hash(*replay_->newest()), state_hash(truth_));
    for (int i = 6; i < 10; ++i) {
      hair_.step();
      truth_ = hair_.snapshot(kQuantumM);
      ASSERT_TRUE(receive(with_send_time(*(*other)->encode(truth_), stream_id, 1), i * kStepNs))
          << codec << ": " << replay_->stats().last_error;
      EXPECT_EQ(state_hash(*replay_->newest()), state_hash(truth_));
    }
    EXPECT_EQ(replay_->decode_timer().count(), 4u) << "what the other codec took is forgotten";
    encoder_ = std::move(*other);
  }
  EXPECT_EQ(replay_->stats().rejected_frames, 0u);
  EXPECT_EQ(replay_->stats().gaps, 0u);
}

TEST_F(StrandReplayTest, ACodecIsFollowedAtOnceBeforeTheFirstStateAndTheLastWordCounts) {
  auto other = make_strand_encoder("raw");
  ASSERT_TRUE(other);
  EXPECT_EQ(replay_->follow_codec("no such codec", {}).error().code, ErrorCode::NotFound);
  ASSERT_TRUE(replay_->follow_codec("raw", {}).ok());
  hair_.step();
  ASSERT_TRUE(receive((*other)->encode(hair_.snapshot(kQuantumM)))) << "of stream 0, by the other codec";
  ASSERT_TRUE(replay_->follow_codec("delta", {}).ok());
  ASSERT_TRUE(replay_->follow_codec("raw", {}).ok());
  hair_.step();
  ASSERT_TRUE(receive(with_send_time(*(*other)->encode_for_join(hair_.snapshot(kQuantumM)).keyframe, 3, 1)))
      << "the change was taken back";
  EXPECT_EQ(replay_->stats().rejected_frames, 0u);
}

TEST_F(StrandReplayTest, MeasuresMotionLatencyOncePerSampleAndStateAge) {
  // The server's clock is one second ahead; the probe took no time.
  constexpr int64_t kAheadNs = 1'000'000'000;
  clock_.add(0, kAheadNs, kAheadNs, 0);
  for (int i = 0; i < 6; ++i) {
    hair_.step();
    truth_ = hair_.snapshot(kQuantumM);
    // Two states for each motion sample, which arrived 20 ms ago.
    truth_.motion_time_ns = i % 2 == 0 ? now_ns() + kAheadNs - 20 * kMsInNs : truth_.motion_time_ns;
    static int64_t held_ns = 0;
    if (i % 2 == 0) held_ns = truth_.motion_time_ns;
    truth_.motion_time_ns = held_ns;
    ASSERT_TRUE(receive(encoder_->encode(truth_)));
  }
  EXPECT_EQ(replay_->motion_latency_timer().count(), 2u)
      << "three samples; the first may have waited for a viewer";
  EXPECT_GE(replay_->motion_latency_timer().median_ms(), 20.0);
}

TEST(SnapshotTimeline, KeepsAsManyHugeStatesAsFitAndAtLeastTwo) {
  constexpr uint64_t kLimitBytes = 4000;
  const auto newest_count = [](uint64_t bytes_each) {
    SnapshotTimeline timeline(kLimitBytes);
    timeline.set_playout(Playout::Smooth);
    for (int64_t i = 0; i < 40; ++i) {
      auto snapshot = std::make_shared<Snapshot>();
      snapshot->sim_time_ns = i * kStepNs;
      snapshot->lattice.resize(bytes_each / sizeof(int32_t));
      timeline.add(snapshot, i * kStepNs, Continuity::SameStream);
    }
    return timeline.snapshots().size();
  };
  EXPECT_EQ(newest_count(4), kKeptSnapshots);
  EXPECT_EQ(newest_count(kLimitBytes / 4), 4u);
  EXPECT_EQ(newest_count(kLimitBytes / 4 + 4), 3u);
  EXPECT_EQ(newest_count(kLimitBytes / 2 + 4), 2u);
}

TEST(Blend, MeetsBothEndsExactlyAndIsLinearBetween) {
  HairMotion hair({.strand_count = kStrands, .vertex_count = kVertices});
  hair.step();
  const Snapshot from = hair.snapshot(kQuantumM);
  hair.step();
  const Snapshot to = hair.snapshot(kQuantumM);
  StrandFill fill;
  const PosedStrands first = posed_strands_of(from, fill);
  const PosedStrands last = posed_strands_of(to, fill);
  EXPECT_EQ(blend(first, last, 0.0).position_m, positions_in_head(from));
  EXPECT_EQ(blend(first, last, 1.0).position_m, positions_in_head(to));
  EXPECT_EQ(blend(first, last, 1.0).world_from_head, to.world_from_head);
  const auto quarter = blend(first, last, 0.25);
  EXPECT_NEAR(angle_between_rad(from.world_from_head.rotation, to.world_from_head.rotation),
              4.0 * angle_between_rad(from.world_from_head.rotation, quarter.world_from_head.rotation), 1e-6);
  const auto half = blend(first, last, 0.5);
  const auto a = positions_in_head(from);
  const auto b = positions_in_head(to);
  for (size_t i = 0; i < a.size(); ++i)
    EXPECT_LT(glm::length(half.position_m[i] - 0.5f * (a[i] + b[i])), 1e-6f) << i;
  EXPECT_NEAR(angle_between_rad(from.world_from_head.rotation, half.world_from_head.rotation),
              angle_between_rad(half.world_from_head.rotation, to.world_from_head.rotation), 1e-6);
}

}  // namespace
}  // namespace strandcast::strand_replay_test
