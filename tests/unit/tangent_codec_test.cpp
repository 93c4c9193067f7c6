// What the "tangent" codec promises beyond what every codec does: the bound, whatever moves; the bits it is
// made for; the same bytes and states on every path.
#include <random>
#include <set>

#include "common/base/hash.h"
#include "common/base/worker_pool.h"
#include "common/strands/least_squares.h"
#include "common/strands/strand_codec.h"
#include "common/strands/strand_payload.h"
#include "common/strands/tangent/codec.h"
#include "common/strands/tangent/head.h"
#include "common/strands/tangent/layout.h"
#include "common/strands/tangent/symbols.h"
#include "tests/support/hair_motion.h"
#include "tests/support/own_workers.h"

namespace strandcast::tangent_codec_test {
namespace {

using namespace tangent;

constexpr float kBoundM = 1e-4f;

struct Chain {
  std::unique_ptr<StrandEncoder> encoder;
  std::unique_ptr<StrandDecoder> decoder;

  explicit Chain(const HairMotionDesc& desc, std::span<const glm::vec3> rest = {},
                 WorkerPool& workers = shared_workers()) {
    encoder = std::move(*make_strand_encoder("tangent", workers));
    decoder = std::move(*make_strand_decoder("tangent", {desc.strand_count, desc.vertex_count}, workers));
    encoder->set_rest_shape(rest);
    decoder->set_rest_shape(rest);
  }
  std::shared_ptr<const Snapshot> pass(const Snapshot& snapshot) {
    auto decoded = decoder->decode(encoder->encode(snapshot)->message);
    EXPECT_TRUE(decoded) << decoded.error().to_string();
    return decoded ? *decoded : nullptr;
  }
};

double largest_error_m(const std::vector<glm::vec3>& truth, const Snapshot& decoded) {
  const auto shown = positions_in_head(decoded);
  double largest = shown.size() == truth.size() ? 0.0 : INFINITY;
  for (size_t i = 0; i < std::min(truth.size(), shown.size()); ++i)
    largest = std::max(largest, glm::distance(glm::dvec3(truth[i]), glm::dvec3(shown[i])));
  return largest;
}

// Vertices that stretch, jump and collapse, where no prediction helps.
TEST(TangentCodec, StaysWithinTheBoundWhateverHappens) {
  HairMotionDesc desc{40, 12, MotionKind::Active};
  HairMotion hair(desc);
  Chain chain(desc, hair.rest_in_head());
  const float quantum_m = lattice_step_m("tangent", kBoundM).value();
  for (int i = 0; i < 60; ++i) {
    hair.step();
    QuantiseInput input;
    input.tick = static_cast<uint64_t>(i + 1);
    input.strand_count = desc.strand_count;
    input.vertex_count = desc.vertex_count;
    input.quantum_m = quantum_m;
    std::vector<glm::vec3> points = hair.positions_in_head();
    for (size_t k = 0; k < points.size(); ++k) {
      const uint32_t dice = mix_u32(static_cast<uint32_t>(k) * 977u + static_cast<uint32_t>(i)) % 40;
      if (i % 7 == 0 && dice == 0) points[k] *= 7.0f;            // stretched
      if (i % 7 == 1 && dice < 10) points[k] = points[k % 5];    // collapsed
      if (i % 7 == 2 && dice < 3) points[k] = -points[k];        // turned round
      if (i % 7 == 3) points[k] += glm::vec3(0.0f, 3.0f, 1.0f);  // all jump
    }
    input.position_in_head_m = points;
    const auto decoded = chain.pass(quantise(input).snapshot);
    ASSERT_TRUE(decoded);
    double reach_m = 0.0;
    for (const glm::vec3& point : points) reach_m = std::max<double>(reach_m, glm::length(point));
    // Beyond two metres from the head floats become coarser than the allowance made for them.
    const double float_rounding_m = std::max(0.0, reach_m - 2.0) * 6e-8;
    EXPECT_LE(largest_error_m(points, *decoded), kBoundM + float_rounding_m) << "frame " << i;
  }
}

// More than one slice, and enough vertices for several threads.
TEST(TangentCodec, AnyNumberOfThreadsGivesTheSameStateToAllAndToJoiners) {
  for (const uint32_t strands : {1023u, 1024u, 3100u}) {
    HairMotionDesc desc{strands, 16, MotionKind::Extreme};
    HairMotion hair(desc);
    Chain chain(desc, hair.rest_in_head(), *own_workers(4));
    Chain again(desc, hair.rest_in_head(), *own_workers(1));
    auto late = std::move(*make_strand_decoder("tangent", {strands, 16}));
    late->set_rest_shape(hair.rest_in_head());
    for (int i = 0; i < 6; ++i) {
      hair.step();
      const Snapshot snapshot = hair.snapshot(lattice_step_m("tangent", kBoundM).value());
      const JoinFrames frames = chain.encoder->encode_for_join(snapshot);
      EXPECT_TRUE(again.encoder->encode_for_join(snapshot).frame->message == frames.frame->message);
      const auto decoded = chain.decoder->decode(frames.frame->message);
      ASSERT_TRUE(decoded) << decoded.error().to_string();
      EXPECT_LE(largest_error_m(hair.positions_in_head(), **decoded), kBoundM);
      const auto decoded_again = again.decoder->decode(frames.frame->message);
      ASSERT_TRUE(decoded_again) << decoded_again.error().to_string();
      EXPECT_EQ(state_hash(**decoded_again), state_hash(**decoded));
      const auto joined = late->decode(frames.keyframe->message);
      ASSERT_TRUE(joined) << joined.error().to_string();
      EXPECT_EQ(state_hash(**joined), state_hash(**decoded));
    }
  }
}

// Frames of every kind, with vertices that no integers reach among them.
TEST(TangentCodec, EveryInstructionSetGivesTheSameBytesAndStates) {
  constexpr uint32_t kVertices = 9;
  for (const uint32_t strands : {37u, 1030u}) {
    HairMotion hair({strands, kVertices, MotionKind::Extreme});
    const std::vector<glm::vec3> rest = hair.rest_in_head();
    std::vector<Snapshot> states;
    for (int i = 0; i < 8; ++i) {
      hair.step();
      states.push_back(hair.snapshot(lattice_step_m("tangent", kBoundM).value()));
      if (i % 3 == 2)
        for (size_t k = 0; k < states.back().lattice.size(); k += 97) states.back().lattice[k] -= 70'000;
    }
    std::vector<std::vector<std::byte>> expected;  // by the plain one, which is the first
    for (const simd::InstructionSet set : simd::instruction_sets()) {
      SCOPED_TRACE(simd::to_string(set));
      std::vector<std::vector<std::byte>> messages;
      const auto encoder = make_encoder(shared_workers(), set);
      const auto decoder = make_decoder({strands, kVertices}, shared_workers(), set);
      const auto joiner = make_decoder({strands, kVertices}, shared_workers(), set);
      encoder->set_rest_shape(rest);
      decoder->set_rest_shape(rest);
      joiner->set_rest_shape(rest);
      // Decoders hold what they decode against the hash that the encoder announced.
      for (size_t i = 0; i < states.size(); ++i) {
        if (i % 4 == 3) {
          const JoinFrames frames = encoder->encode_for_join(states[i]);
          messages.push_back(frames.keyframe->message);
          messages.push_back(frames.frame->message);
          EXPECT_TRUE(joiner->decode(frames.keyframe->message)) << "frame " << i;
        } else {
          messages.push_back(encoder->encode(states[i])->message);
        }
        EXPECT_TRUE(decoder->decode(messages.back())) << "frame " << i;
      }
      if (expected.empty()) expected = messages;
      EXPECT_TRUE(messages == expected);
    }
  }
}

TEST(TangentCodec, AnotherRestShapeIsNoticed) {
  HairMotionDesc desc{20, 8, MotionKind::Active};
  HairMotion hair(desc);
  Chain chain(desc, hair.rest_in_head());
  auto other = hair.rest_in_head();
  for (glm::vec3& point : other) point *= 1.1f;
  chain.decoder->set_rest_shape(other);
  hair.step();
  const auto frame = chain.encoder->encode(hair.snapshot(lattice_step_m("tangent", kBoundM).value()));
  const auto decoded = chain.decoder->decode(frame->message);
  ASSERT_FALSE(decoded);
  EXPECT_EQ(decoded.error().code, ErrorCode::BadInput);
}

struct Rate {
  double delta_bits = 0.0;  // per vertex, headers included
  double keyframe_bits = 0.0;
};

Rate rate_of(const std::string& codec, MotionKind kind) {
  HairMotion hair({1200, 16, kind});
  for (int i = 0; i < 60; ++i) hair.step();  // until it hangs
  auto encoder = std::move(*make_strand_encoder(codec));
  encoder->set_rest_shape(hair.rest_in_head());
  const float quantum_m = lattice_step_m(codec, kBoundM).value();
  Rate rate;
  constexpr int kFrames = 20;
  for (int i = -10; i < kFrames; ++i) {
    hair.step();
    const auto frame = encoder->encode(hair.snapshot(quantum_m));
    if (i >= 0) rate.delta_bits += 8.0 * static_cast<double>(frame->message.size()) / kFrames;
  }
  hair.step();
  rate.keyframe_bits =
      8.0 * static_cast<double>(encoder->encode_for_join(hair.snapshot(quantum_m)).keyframe->message.size());
  rate.delta_bits /= static_cast<double>(hair.plane_size());
  rate.keyframe_bits /= static_cast<double>(hair.plane_size());
  return rate;
}

TEST(TangentCodec, NeedsFarFewerBitsThanTheExactLattice) {
  for (const MotionKind kind : {MotionKind::Idle, MotionKind::Active, MotionKind::Extreme}) {
    const Rate tangent = rate_of("tangent", kind);
    const Rate delta = rate_of("delta", kind);
    EXPECT_LT(tangent.delta_bits, 0.65 * delta.delta_bits);
    EXPECT_LT(tangent.keyframe_bits, 0.75 * delta.keyframe_bits);
  }
  // What the codec is made for, with some room for so few strands: 1.8, 3.5 and 6 for 10,000 of them.
  EXPECT_LT(rate_of("tangent", MotionKind::Idle).delta_bits, 2.3);
  EXPECT_LT(rate_of("tangent", MotionKind::Active).delta_bits, 3.5);
  EXPECT_LT(rate_of("tangent", MotionKind::Extreme).delta_bits, 6.0);
}

// A frame that somebody joins with costs the others as much as any; the motion that all forget then costs a
// few frames.
TEST(TangentCodec, AJoinCostsTheOthersAFewFrames) {
  HairMotionDesc desc{1200, 16, MotionKind::Active};
  HairMotion hair(desc);
  Chain chain(desc, hair.rest_in_head());
  const float quantum_m = lattice_step_m("tangent", kBoundM).value();
  const auto next_bytes = [&] {
    hair.step();
    return static_cast<double>(chain.encoder->encode(hair.snapshot(quantum_m))->message.size());
  };
  for (int i = 0; i < 60; ++i) next_bytes();
  const double before = next_bytes();
  hair.step();
  const JoinFrames frames = chain.encoder->encode_for_join(hair.snapshot(quantum_m));
  EXPECT_LT(static_cast<double>(frames.frame->message.size()), 1.25 * before);
  EXPECT_LT(static_cast<double>(frames.frame->message.size()),
            0.6 * static_cast<double>(frames.keyframe->message.size()));
  EXPECT_LT(next_bytes(), 2.5 * before);
  for (int i = 0; i < 3; ++i) next_bytes();
  EXPECT_LT(next_bytes(), 1.25 * before);
}

/// Bits per vertex of the first keyframe of hair, after `steps` of its motion, beyond the tables.
double shape_bits(HairMotion& hair, int steps, std::span<const glm::vec3> rest) {
  for (int i = 0; i < steps; ++i) hair.step();
  auto encoder = std::move(*make_strand_encoder("tangent"));
  encoder->set_rest_shape(rest);
  const auto first = encoder->encode(hair.snapshot(lattice_step_m("tangent", kBoundM).value()));
  const std::vector<std::byte>& bytes = first->message;
  uint32_t table_bytes = 0;
  std::memcpy(&table_bytes, bytes.data() + kFrameHeaderBytes + kStrandFixedBytes, sizeof(table_bytes));
  return 8.0 * static_cast<double>(bytes.size() - table_bytes) / static_cast<double>(hair.plane_size());
}

// Hair at rest has the shape that both sides know; hair in motion is told by neighbours and by its own edges.
TEST(TangentCodec, KeyframesTellOnlyWhatTheShapeDoesNot) {
  HairMotion still({1200, 16, MotionKind::Still});
  HairMotion moving({1200, 16, MotionKind::Active});
  const double still_bits = shape_bits(still, 0, still.rest_in_head());
  const double moving_bits = shape_bits(moving, 60, moving.rest_in_head());
  const double unknown_bits = shape_bits(moving, 0, {});
  // Three symbols, nearly always 0 or 1, in tables that begin with two bits for a 0.
  EXPECT_LT(still_bits, 3.5);
  EXPECT_LT(still_bits, 0.5 * moving_bits);
  EXPECT_LT(moving_bits, 0.6 * unknown_bits);
}

TEST(TangentWeights, ComeBackWhateverTheyAre) {
  std::mt19937 random(5);
  for (const uint32_t class_count : {1u, kFewMotionClasses, kMotionClassCount}) {
    for (const int32_t largest : {0, 3, 2'000, INT16_MAX}) {
      MotionWeights weights{};
      for (uint32_t c = 0; c < class_count; ++c)
        for (int16_t& weight : weights[c])
          weight = static_cast<int16_t>(
              static_cast<int32_t>(random() % (2 * static_cast<uint32_t>(largest) + 1)) - largest);
      if (largest == INT16_MAX) weights[0] = {INT16_MIN, INT16_MAX, INT16_MIN, 0, INT16_MAX};
      ValueWriter writer;
      write_weights(class_count, weights, writer);
      std::vector<std::byte> bytes;
      writer.finish(bytes);
      ValueReader reader;
      ASSERT_TRUE(reader.open(bytes));
      MotionWeights read;
      for (auto& row : read) row.fill(77);
      read_weights(class_count, read, reader);
      EXPECT_TRUE(reader.is_spent());
      EXPECT_TRUE(read == weights);
    }
  }
}

// Of y = x with x = +-100 known to within 50 when it counts, 100^2 / (100^2 + 50^2) is the best weight,
// whatever all samples count.
TEST(LeastSquares, TrustsFeaturesAsFarAsTheyAreExact) {
  for (const float trust : {1.0f, 0.25f}) {
    LeastSquares<2> fit;
    for (int i = 0; i < 1000; ++i) {
      const float x = i % 2 == 0 ? 100.0f : -100.0f;
      fit.add({x, i % 4 < 2 ? 100.0f : -100.0f}, x, trust);
    }
    fit.flush();
    EXPECT_NEAR(fit.weights(1e-4, {50.0, 0.0})[0], 8'000, 1);
    EXPECT_NEAR(fit.weights(1e-4, {0.0, 50.0})[0], 10'000, 1);
    EXPECT_NEAR(fit.weights(1e-4, {50.0, 0.0})[1], 0, 1);
  }
}

Pose jittered_pose(uint32_t salt) {
  const auto random = [salt](uint32_t k) { return 2.0 * unit_float(mix_u32(7u * salt + k)) - 1.0; };
  Pose pose;
  pose.position_m = 0.002 * glm::dvec3(random(0), random(1), random(2));
  pose.rotation = glm::angleAxis(0.02 * random(3), glm::normalize(glm::dvec3(random(4), random(5), 1.5)));
  return pose;
}

glm::dvec3 to_head(const Pose& world_from_head, const glm::dvec3& point) {
  return glm::conjugate(world_from_head.rotation) * (point - world_from_head.position_m);
}

TEST(TangentHead, StepsMovePointsThatRestInTheWorld) {
  constexpr float kStepM = 4e-7f;
  tangent::HeadMotion head;
  head.pose = jittered_pose(0);
  for (uint32_t frame = 1; frame < 10; ++frame) {
    head = head.followed_by(jittered_pose(frame), kStepM);
    for (uint32_t age = 0; age < kHeadStepCount; ++age) {
      const glm::dvec3 point(0.1, -0.2, 0.05 * frame);
      const bool is_known = age < frame;
      const glm::dvec3 then = is_known ? to_head(jittered_pose(frame - age - 1), point) : glm::dvec3(0.0);
      const glm::dvec3 now = is_known ? to_head(jittered_pose(frame - age), point) : glm::dvec3(0.0);
      for (int axis = 0; axis < 3; ++axis) {
        const auto& row = head.step[age].row[static_cast<size_t>(axis)];
        const double change = (row[0] * then.x + row[1] * then.y) + row[2] * then.z + row[3] * kStepM;
        EXPECT_NEAR(change, now[axis] - then[axis], 1e-9) << "frame " << frame << ", step " << age;
      }
    }
  }
  // A head that stays has steps of nothing at all, however long its quaternion is.
  Pose longer = jittered_pose(1);
  longer.rotation *= 1.0004;
  head = tangent::HeadMotion{longer, {}}.followed_by(longer, kStepM);
  for (const auto& row : head.step[0].row)
    for (const double coefficient : row) EXPECT_EQ(coefficient, 0.0);
}

// Hair that rests in the world while the head trembles under it: all its motion in head space is foretold.
TEST(TangentCodec, PosesOfTheHeadForetellWhatLagsBehindIt) {
  const HairMotion hair({1200, 16, MotionKind::Still});
  const auto bits_of = [&](bool has_poses) {
    auto encoder = std::move(*make_strand_encoder("tangent"));
    encoder->set_rest_shape(hair.rest_in_head());
    size_t bytes = 0;
    for (uint32_t frame = 0; frame < 12; ++frame) {
      const Pose pose = jittered_pose(frame);
      std::vector<glm::vec3> points;
      for (const glm::vec3& point : hair.rest_in_head()) points.emplace_back(to_head(pose, point));
      QuantiseInput input;
      input.strand_count = 1200;
      input.vertex_count = 16;
      input.quantum_m = lattice_step_m("tangent", kBoundM).value();
      input.position_in_head_m = points;
      if (has_poses) input.world_from_head = pose;
      const EncodedFramePtr message = encoder->encode(quantise(input).snapshot);
      if (frame >= 4) bytes += message->message.size();
    }
    return 8.0 * static_cast<double>(bytes) / (8.0 * static_cast<double>(hair.plane_size()));
  };
  const double with_poses = bits_of(true);
  const double without_poses = bits_of(false);
  EXPECT_LT(with_poses, 0.7 * without_poses);
}

TEST(TangentLayout, EveryStrandHasOnePlaceAndNeighboursComeBefore) {
  for (const uint32_t strands : {1u, 7u, 1023u, 1024u, 2047u, 5000u}) {
    HairMotion hair({strands, 3, MotionKind::Still});
    const Layout layout = make_layout(strands, 3, hair.rest_in_head());
    EXPECT_EQ(layout.slice_count(), strands < 1024 ? 1u : 8u);
    std::set<uint32_t> seen;
    for (uint32_t slice = 0; slice < layout.slice_count(); ++slice) {
      EXPECT_EQ(layout.slice_begin[slice] % kBlockSize, 0u);
      for (uint32_t place = layout.slice_begin[slice]; place < layout.slice_begin[slice + 1]; ++place) {
        if (layout.strand_at[place] != kNoStrand) {
          EXPECT_TRUE(seen.insert(layout.strand_at[place]).second);
        }
        for (const auto& neighbour : layout.neighbour) {
          if (neighbour[place] == layout.no_neighbour()) continue;
          EXPECT_GE(neighbour[place], layout.slice_begin[slice]);
          EXPECT_LT(neighbour[place] / kBlockSize, place / kBlockSize);
        }
      }
    }
    EXPECT_EQ(seen.size(), strands);
    EXPECT_EQ(layout.stride, layout.slice_begin.back() + kBlockSize);
  }
}

// The two nearest roots among the strands of the slice that both sides know already, 64 places back at most.
TEST(TangentLayout, NeighboursAreTheNearestOfThoseBefore) {
  constexpr uint32_t kWindow = 64;
  for (const uint32_t strands : {200u, 2047u}) {
    HairMotion hair({strands, 2, MotionKind::Still});
    const std::vector<glm::vec3> rest = hair.rest_in_head();
    const Layout layout = make_layout(strands, 2, rest);
    const auto away_m = [&](uint32_t place, uint32_t other) {
      return other == layout.no_neighbour()
                 ? INFINITY
                 : glm::distance(rest[layout.strand_at[place]], rest[layout.strand_at[other]]);
    };
    for (uint32_t slice = 0; slice < layout.slice_count(); ++slice) {
      const uint32_t begin = layout.slice_begin[slice];
      for (uint32_t place = begin; place < layout.slice_begin[slice + 1]; ++place) {
        if (layout.strand_at[place] == kNoStrand) continue;
        const uint32_t end = place / kBlockSize * kBlockSize;
        std::vector<float> nearest_m = {INFINITY, INFINITY};
        for (uint32_t other = begin; other < end; ++other)
          if (other + kWindow >= end) nearest_m.push_back(away_m(place, other));
        std::sort(nearest_m.begin(), nearest_m.end());
        for (size_t k = 0; k < layout.neighbour.size(); ++k)
          EXPECT_FLOAT_EQ(away_m(place, layout.neighbour[k][place]), nearest_m[k]) << "place " << place;
      }
    }
  }
}

// The first slices are an even thinning: an eighth, a quarter, a half of every region.
TEST(TangentLayout, TheFirstSlicesThinTheGroomEvenly) {
  constexpr uint32_t kStrands = 4096;
  HairMotion hair({kStrands, 2, MotionKind::Still});
  const Layout layout = make_layout(kStrands, 2, hair.rest_in_head());
  const auto share_left = [&](uint32_t slices) {
    int left = 0;
    int all = 0;
    for (uint32_t place = 0; place < layout.slice_begin[slices]; ++place) {
      if (layout.strand_at[place] == kNoStrand) continue;
      ++all;
      if (hair.rest_in_head()[layout.strand_at[place]].x < 0.0f) ++left;
    }
    return static_cast<double>(left) / all;
  };
  EXPECT_NEAR(layout.slice_begin[1], kStrands / 8, kBlockSize);
  EXPECT_NEAR(layout.slice_begin[4], kStrands / 2, 4 * kBlockSize);
  for (const uint32_t slices : {1u, 2u, 4u}) EXPECT_NEAR(share_left(slices), share_left(8), 0.02);
}

}  // namespace
}  // namespace strandcast::tangent_codec_test
