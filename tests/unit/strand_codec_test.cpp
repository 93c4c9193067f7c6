#include "common/strands/strand_codec.h"

#include <random>
#include <set>

#include "common/strands/strand_payload.h"
#include "common/strands/strand_predictor.h"
#include "common/strands/tangent/motion.h"
#include "tests/support/hair_motion.h"

namespace strandcast::strand_codec_test {
namespace {

using namespace tangent;

constexpr float kBoundM = 1e-4f;
constexpr const char* kRoundingCodec = "tangent";

/// All others give back the lattice they are given.
bool rounds_itself(const std::string& codec) {
  return codec == kRoundingCodec || codec == "step";
}

float quantum_for(const std::string& codec) {
  return lattice_step_m(codec, kBoundM).value();
}

std::unique_ptr<StrandDecoder> decoder_for(const std::string& codec, uint32_t strand_count,
                                           uint32_t vertex_count) {
  auto decoder = make_strand_decoder(codec, {strand_count, vertex_count});
  EXPECT_TRUE(decoder) << decoder.error().to_string();
  return std::move(decoder).value();
}

std::unique_ptr<StrandEncoder> encoder_for(const std::string& codec) {
  auto encoder = make_strand_encoder(codec);
  EXPECT_TRUE(encoder) << encoder.error().to_string();
  return std::move(encoder).value();
}

void expect_same(const Snapshot& decoded, const Snapshot& original) {
  EXPECT_EQ(decoded.tick, original.tick);
  EXPECT_EQ(decoded.sim_time_ns, original.sim_time_ns);
  EXPECT_EQ(decoded.motion_time_ns, original.motion_time_ns);
  EXPECT_EQ(decoded.world_from_head, original.world_from_head);
  EXPECT_EQ(decoded.strand_count, original.strand_count);
  EXPECT_EQ(decoded.vertex_count, original.vertex_count);
  EXPECT_EQ(decoded.quantum_m, original.quantum_m);
  EXPECT_TRUE(decoded.lattice == original.lattice);
}

double largest_distance_m(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b) {
  double largest = a.size() == b.size() ? 0.0 : INFINITY;
  for (size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    largest = std::max(largest, glm::distance(glm::dvec3(a[i]), glm::dvec3(b[i])));
  return largest;
}

/// Largest distance between two lattices of the same step, m: exact, also far from the origin.
double largest_error_m(const Snapshot& a, const Snapshot& b) {
  double largest = 0.0;
  const size_t plane = a.plane_size();
  for (size_t i = 0; i < plane; ++i) {
    double squared = 0.0;
    for (size_t axis = 0; axis < 3; ++axis) {
      const double steps = static_cast<double>(a.lattice[axis * plane + i]) - b.lattice[axis * plane + i];
      squared += steps * steps;
    }
    largest = std::max(largest, std::sqrt(squared) * a.quantum_m);
  }
  return largest;
}

/// The same state; positions exactly, or within the bound where the codec rounds.
void expect_shows(const std::string& codec, const Snapshot& decoded, const Snapshot& original) {
  if (!rounds_itself(codec)) return expect_same(decoded, original);
  ASSERT_EQ(decoded.lattice.size(), original.lattice.size());
  EXPECT_LE(largest_error_m(decoded, original), original.quantum_m * kStepsPerBound);
  Snapshot otherwise = decoded;
  otherwise.lattice = original.lattice;
  expect_same(otherwise, original);
}

Snapshot random_snapshot(uint32_t strand_count, uint32_t vertex_count, int32_t reach, std::mt19937& random) {
  Snapshot snapshot;
  snapshot.strand_count = strand_count;
  snapshot.vertex_count = vertex_count;
  snapshot.quantum_m = quantum_for(kRoundingCodec);
  snapshot.lattice.resize(3 * snapshot.plane_size());
  std::uniform_int_distribution<int32_t> any(-reach, reach);
  for (int32_t& value : snapshot.lattice) value = any(random);
  return snapshot;
}

class EveryCodec : public testing::TestWithParam<std::string> {};

std::vector<std::string> codec_names() {
  std::vector<std::string> names;
  for (const auto& info : strand_codecs()) names.push_back(info.name);
  return names;
}

INSTANTIATE_TEST_SUITE_P(Table, EveryCodec, testing::ValuesIn(codec_names()),
                         [](const auto& parameter) { return parameter.param; });

TEST_P(EveryCodec, DecodesEveryMotion) {
  for (const MotionKind kind :
       {MotionKind::Still, MotionKind::Idle, MotionKind::Active, MotionKind::Extreme}) {
    for (const auto& [strands, vertices] : {std::pair{1u, 2u}, {1u, 64u}, {7u, 3u}, {130u, 16u}, {33u, 5u}}) {
      HairMotionDesc desc{strands, vertices, kind};
      desc.origin_m = {100.0, -3.0, 70.0};
      HairMotion hair(desc);
      const auto encoder = encoder_for(GetParam());
      const auto decoder = decoder_for(GetParam(), strands, vertices);
      for (int i = 0; i < 30; ++i) {
        hair.step();
        const Snapshot snapshot = hair.snapshot(quantum_for(GetParam()));
        const auto frame = encoder->encode(snapshot);
        ASSERT_TRUE(frame);
        EXPECT_EQ(frame->header.sequence, static_cast<uint32_t>(i + 1));
        const auto decoded = decoder->decode(frame->message);
        ASSERT_TRUE(decoded) << decoded.error().to_string();
        expect_shows(GetParam(), **decoded, snapshot);
      }
    }
  }
}

TEST_P(EveryCodec, SurvivesAnyJumpWithinTheLattice) {
  std::mt19937 random(11);
  const int32_t kFarthest = kMaxLattice - (rounds_itself(GetParam()) ? 512 : 1);
  for (const auto& [strands, vertices] : {std::pair{1u, 2u}, {3u, 64u}, {50u, 4u}}) {
    const auto encoder = encoder_for(GetParam());
    const auto decoder = decoder_for(GetParam(), strands, vertices);
    for (int i = 0; i < 40; ++i) {
      const int32_t reach = i % 3 == 0 ? kFarthest : i % 3 == 1 ? 4 : 100'000;
      const Snapshot snapshot = random_snapshot(strands, vertices, reach, random);
      const auto decoded = decoder->decode(encoder->encode(snapshot)->message);
      ASSERT_TRUE(decoded) << decoded.error().to_string();
      expect_shows(GetParam(), **decoded, snapshot);
    }
    for (const int32_t corner : {kFarthest, -kFarthest, kFarthest}) {
      Snapshot snapshot = random_snapshot(strands, vertices, 1, random);
      std::fill(snapshot.lattice.begin(), snapshot.lattice.end(), corner);
      const auto decoded = decoder->decode(encoder->encode(snapshot)->message);
      ASSERT_TRUE(decoded) << decoded.error().to_string();
      expect_shows(GetParam(), **decoded, snapshot);
    }
  }
}

TEST_P(EveryCodec, DoesNotDriftOverManyFrames) {
  HairMotion hair({3, 6, MotionKind::Active});
  const auto encoder = encoder_for(GetParam());
  const auto decoder = decoder_for(GetParam(), 3, 6);
  double worst_m = 0.0;
  for (int i = 0; i < 12'000; ++i) {
    hair.step();
    const Snapshot snapshot = hair.snapshot(quantum_for(GetParam()));
    const auto decoded = decoder->decode(encoder->encode(snapshot)->message);
    ASSERT_TRUE(decoded) << decoded.error().to_string();
    if (!rounds_itself(GetParam())) {
      ASSERT_TRUE((*decoded)->lattice == snapshot.lattice) << "frame " << i;
    }
    worst_m = std::max(worst_m, largest_distance_m(hair.positions_in_head(), positions_in_head(**decoded)));
  }
  EXPECT_LE(worst_m, 1e-4);
}

TEST_P(EveryCodec, LateJoinerContinuesOnTheSharedChainFromAnyFrame) {
  HairMotion hair({60, 10, MotionKind::Active});
  const auto encoder = encoder_for(GetParam());
  std::vector<std::unique_ptr<StrandDecoder>> viewers;
  for (int i = 0; i < 25; ++i) {
    hair.step();
    const Snapshot snapshot = hair.snapshot(quantum_for(GetParam()));
    const bool is_joined = i % 3 != 1;
    const JoinFrames frames =
        is_joined ? encoder->encode_for_join(snapshot) : JoinFrames{encoder->encode(snapshot), nullptr};
    ASSERT_TRUE(frames.frame);
    std::set<uint64_t> states;
    for (const auto& viewer : viewers) {
      const auto decoded = viewer->decode(frames.frame->message);
      ASSERT_TRUE(decoded) << decoded.error().to_string();
      expect_shows(GetParam(), **decoded, snapshot);
      states.insert(state_hash(**decoded));
    }
    if (!is_joined) continue;
    ASSERT_TRUE(frames.keyframe);
    EXPECT_EQ(frames.keyframe->header.opcode, Opcode::StrandKeyframe);
    EXPECT_EQ(frames.keyframe->header.sequence, frames.frame->header.sequence);
    viewers.push_back(decoder_for(GetParam(), 60, 10));
    const auto joined = viewers.back()->decode(frames.keyframe->message);
    ASSERT_TRUE(joined) << joined.error().to_string();
    states.insert(state_hash(**joined));
    EXPECT_EQ(states.size(), 1u) << "everybody has the same state";
  }
}

TEST_P(EveryCodec, StartsANewChainWhenShapeOrStepChange) {
  std::mt19937 random(5);
  const auto encoder = encoder_for(GetParam());
  Snapshot snapshot = random_snapshot(4, 8, 1000, random);
  encoder->encode(snapshot);
  encoder->encode(snapshot);
  snapshot.quantum_m *= 2.0f;
  EXPECT_EQ(encoder->encode(snapshot)->header.opcode, Opcode::StrandKeyframe);
  std::swap(snapshot.strand_count, snapshot.vertex_count);
  const auto frame = encoder->encode(snapshot);
  EXPECT_EQ(frame->header.opcode, Opcode::StrandKeyframe);
  const auto decoded = decoder_for(GetParam(), 8, 4)->decode(frame->message);
  ASSERT_TRUE(decoded) << decoded.error().to_string();
  expect_shows(GetParam(), **decoded, snapshot);
}

class EveryChainedCodec : public EveryCodec {};

INSTANTIATE_TEST_SUITE_P(Table, EveryChainedCodec, testing::Values("delta", "tangent"),
                         [](const auto& parameter) { return parameter.param; });

TEST_P(EveryChainedCodec, ALostFrameIsNoticedAndAKeyframeRecovers) {
  HairMotion hair({20, 8, MotionKind::Active});
  const auto encoder = encoder_for(GetParam());
  const auto decoder = decoder_for(GetParam(), 20, 8);
  std::vector<EncodedFramePtr> frames;
  std::vector<Snapshot> snapshots;
  for (int i = 0; i < 6; ++i) {
    hair.step();
    snapshots.push_back(hair.snapshot(quantum_for(GetParam())));
    frames.push_back(encoder->encode(snapshots.back()));
  }
  EXPECT_EQ(decoder->decode(frames[1]->message).error().code, ErrorCode::Unavailable);  // before any keyframe
  ASSERT_TRUE(decoder->decode(frames[0]->message));
  ASSERT_TRUE(decoder->decode(frames[1]->message));
  EXPECT_EQ(decoder->decode(frames[3]->message).error().code, ErrorCode::Unavailable);
  EXPECT_EQ(decoder->decode(frames[1]->message).error().code, ErrorCode::Unavailable);  // twice
  const auto next = decoder->decode(frames[2]->message);  // the errors left the state alone
  ASSERT_TRUE(next);
  expect_shows(GetParam(), **next, snapshots[2]);
  const auto keyframe = encoder->encode_for_join(snapshots[5]).keyframe;
  const auto recovered = decoder->decode(keyframe->message);
  ASSERT_TRUE(recovered);
  expect_shows(GetParam(), **recovered, snapshots[5]);
  hair.step();
  const auto after = decoder->decode(encoder->encode(hair.snapshot(quantum_for(GetParam())))->message);
  EXPECT_TRUE(after);
}

TEST_P(EveryChainedCodec, StateIsUnchangedAfterADamagedFrame) {
  HairMotion hair({20, 8, MotionKind::Active});
  const auto encoder = encoder_for(GetParam());
  const auto decoder = decoder_for(GetParam(), 20, 8);
  std::mt19937 random(1);
  // Behind the weights, of which many carry little: the features of so few strands are often zero.
  const size_t weight_bytes = rounds_itself(GetParam())
                                  ? 2 + kFewMotionClasses * sizeof(MotionWeights::value_type)
                                  : sizeof(PredictorWeights);
  const size_t content_at = kFrameHeaderBytes + kStrandFixedBytes + weight_bytes;
  int refused_everything = 0;
  for (int i = 0; i < 40; ++i) {
    hair.step();
    const Snapshot snapshot = hair.snapshot(quantum_for(GetParam()));
    const auto frame = encoder->encode(snapshot);
    bool is_accepted = false;
    for (int trial = 0; trial < 20 && i > 0 && !is_accepted; ++trial) {
      auto damaged = frame->message;
      const size_t place = content_at + random() % (damaged.size() - content_at);
      damaged[place] ^= static_cast<std::byte>(1 + random() % 255);
      const auto result = decoder->decode(damaged);
      if (!result) continue;
      // Possible where a byte carries nothing, such as the weight of a feature that is zero everywhere.
      expect_shows(GetParam(), **result, snapshot);
      is_accepted = true;
    }
    if (is_accepted) continue;
    ++refused_everything;
    const auto decoded = decoder->decode(frame->message);
    ASSERT_TRUE(decoded) << decoded.error().to_string();
    expect_shows(GetParam(), **decoded, snapshot);
  }
  EXPECT_GT(refused_everything, 20);
}

TEST_P(EveryChainedCodec, ConstantStateCostsNextToNothing) {
  HairMotion hair({500, 16, MotionKind::Still});
  const Snapshot snapshot = hair.snapshot(quantum_for(GetParam()));
  const auto encoder = encoder_for(GetParam());
  encoder->encode(snapshot);
  for (int i = 0; i < 20; ++i) encoder->encode(snapshot);
  // Header, fixed part and weights take 260 bytes at most. The rest is one run for zstd, or the least share
  // of a symbol.
  EXPECT_LT(encoder->encode(snapshot)->message.size(), 400u);
}

TEST_P(EveryChainedCodec, MeetsTheBitRateOfTheBuiltInSceneSize) {
  // 20 Mbit/s at 60 Hz for 2,000 x 16 vertices is 10.4 bits per vertex.
  HairMotion hair({2000, 16, MotionKind::Active});
  const auto encoder = encoder_for(GetParam());
  double bits = 0.0;
  constexpr int kFrames = 30;
  for (int i = -10; i < kFrames; ++i) {
    hair.step();
    const auto frame = encoder->encode(hair.snapshot(quantum_for(GetParam())));
    if (i >= 0) bits += 8.0 * static_cast<double>(frame->message.size());
  }
  EXPECT_LT(bits / kFrames / static_cast<double>(hair.plane_size()), 10.4);
}

TEST(StrandCodecs, UnknownNamesListTheKnownOnes) {
  const auto encoder = make_strand_encoder("gzip");
  ASSERT_FALSE(encoder);
  EXPECT_EQ(encoder.error().code, ErrorCode::NotFound);
  EXPECT_THAT(encoder.error().message,
              testing::AllOf(testing::HasSubstr("gzip"), testing::HasSubstr("delta, raw, tangent")));
}

TEST(StrandCodecs, RefuseAnnouncedSizesBeyondTheLimits) {
  for (const auto& [strands, vertices] : {std::pair{0u, 4u}, {200'001u, 4u}, {4u, 1u}, {4u, 65u}, {~0u, ~0u}})
    EXPECT_EQ(make_strand_decoder("delta", {strands, vertices}).error().code, ErrorCode::LimitExceeded);
}

}  // namespace
}  // namespace strandcast::strand_codec_test
