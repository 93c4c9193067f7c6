// What classes of strands and pictures are said to cost, against frames of known size and time.
#include "server/net/stream_costs.h"
#include "common/base/units.h"

#include <set>

namespace strandcast::stream_costs_test {
namespace {
constexpr int64_t kStepNs = kSInNs / 60;

FrameHeader frame_of(uint16_t stream_id, Opcode opcode = Opcode::StrandDelta) {
  FrameHeader header;
  header.opcode = opcode;
  header.stream_id = stream_id;
  return header;
}

StrandByteModel bytes_of(const char* codec) {
  return strand_codec_info(codec)->bytes;
}

StrandCosts costs_of_built_in() {
  return StrandCosts(make_strand_classes({60.0, 0.0, 1e-4f, 2'000}), {bytes_of("tangent")});
}

TEST(StrandCosts, UnmeasuredClassesFollowFromTheOneThatWas) {
  StrandCosts costs = costs_of_built_in();
  EXPECT_TRUE(costs.bytes_per_s(0).empty()) << "nothing is known yet";
  costs.note_frame(frame_of(1, Opcode::StrandKeyframe), 1'000'000, kSInNs);
  EXPECT_TRUE(costs.bytes_per_s(0).empty()) << "a keyframe says nothing about deltas";
  costs.note_frame(frame_of(static_cast<uint16_t>(costs.classes().size())), 1'000'000, kSInNs);
  EXPECT_TRUE(costs.bytes_per_s(0).empty()) << "of no class";
  costs.note_frame(frame_of(1), 5'000, kSInNs);
  const std::vector<double> found = costs.bytes_per_s(0);
  ASSERT_EQ(found.size(), costs.classes().size());
  const StrandClass& measured = costs.classes()[1];
  EXPECT_DOUBLE_EQ(found[1], 5'000 * measured.frame_rate_hz);
  for (size_t i = 0; i < found.size(); ++i)
    EXPECT_NEAR(found[i], expected_bytes_per_s(bytes_of("tangent"), {measured, 5'000}, costs.classes()[i]),
                1e-6)
        << i;
}

TEST(StrandCosts, TheFirstFrameOfAChainCountsLikeOthers) {
  StrandCosts costs = costs_of_built_in();
  const double rate_hz = costs.classes()[0].frame_rate_hz;
  costs.note_frame(frame_of(0), 20'000, kSInNs);
  for (int i = 1; i < 10; ++i) costs.note_frame(frame_of(0), 5'000, kSInNs + i * kStepNs);
  EXPECT_NEAR(costs.bytes_per_s(0)[0], 6'500 * rate_hz, 1e-6 * rate_hz);
  for (int i = 10; i < 110; ++i) costs.note_frame(frame_of(0), 10'000, kSInNs + i * kStepNs);
  EXPECT_NEAR(costs.bytes_per_s(0)[0], 10'000 * rate_hz, 0.01 * 10'000 * rate_hz) << "and what changes shows";
}

// Laws of the estimate, for every codec and any frame.
TEST(StrandBytes, EstimatesAgreeWithEachOther) {
  const std::vector<StrandClass> classes = make_strand_classes({60.0, 0.0, 1e-4f, 2'000});
  for (const StrandCodecInfo& codec : strand_codecs()) {
    SCOPED_TRACE(codec.name);
    for (const double bytes : {40.0, 250.0, 2'000.0, 30'000.0})
      for (const StrandClass& from : classes) {
        EXPECT_NEAR(expected_bytes_per_s(codec.bytes, {from, bytes}, from), bytes * from.frame_rate_hz, 1e-6);
        const double there = expected_bytes_per_s(codec.bytes, {from, bytes}, classes[0]);
        EXPECT_GE(there, bytes * from.frame_rate_hz * (1.0 - 1e-9)) << "the first takes most";
        const MeasuredClass back{classes[0], there / classes[0].frame_rate_hz};
        EXPECT_NEAR(expected_bytes_per_s(codec.bytes, back, from), bytes * from.frame_rate_hz,
                    1e-6 * bytes * from.frame_rate_hz)
            << "there and back";
      }
  }
}

// As measured of the built-in walk with dftl, 2,000 x 16 (step_bench --classes yes): few strands take much
// of what all do, since every frame tells of the step.
TEST(StrandBytes, FewStrandsSaveLittleOfStep) {
  const std::vector<StrandClass> classes = make_strand_classes({60.0, 0.0, 1e-4f, 2'000});
  struct Measured {
    const char* codec;
    double mbit_per_s[9];
  };
  constexpr Measured kWalk[] = {{"tangent", {3.821, 2.043, 1.092, 0.615, 0.433, 0.360, 0.205, 0.177, 0.138}},
                                {"step", {0.132, 0.109, 0.092, 0.084, 0.046, 0.036, 0.035, 0.031, 0.026}}};
  for (const Measured& walk : kWalk)
    for (size_t i = 0; i < classes.size(); ++i) {
      const MeasuredClass all{classes[0], walk.mbit_per_s[0] * 125e3 / classes[0].frame_rate_hz};
      EXPECT_NEAR(expected_bytes_per_s(bytes_of(walk.codec), all, classes[i]) / 125e3, walk.mbit_per_s[i],
                  0.25 * walk.mbit_per_s[i])
          << walk.codec << ", " << to_string(classes[i]);
    }
}

TEST(StrandCosts, WhatIsMeasuredCountsUntilItIsOld) {
  StrandCosts costs = costs_of_built_in();
  costs.note_frame(frame_of(0), 10'000, kSInNs);
  costs.note_frame(frame_of(2), 1'000, kSInNs + kStepNs);
  EXPECT_DOUBLE_EQ(costs.bytes_per_s(0)[0], 10'000 * costs.classes()[0].frame_rate_hz);
  costs.note_frame(frame_of(2), 1'000, 10 * kSInNs);
  EXPECT_NEAR(costs.bytes_per_s(0)[0],
              expected_bytes_per_s(bytes_of("tangent"), {costs.classes()[2], 1'000}, costs.classes()[0]),
              1e-6);
}

TEST(StrandCosts, WhatOneCodecTakesSaysNothingOfTheOther) {
  const size_t class_count = costs_of_built_in().classes().size();
  StrandCosts costs(costs_of_built_in().classes(), {bytes_of("step"), bytes_of("tangent")});
  costs.note_frame(frame_of(stream_id_of({1, 2})), 1'000, kSInNs);
  EXPECT_TRUE(costs.bytes_per_s(0).empty());
  EXPECT_DOUBLE_EQ(costs.bytes_per_s(1)[2], 1'000 * costs.classes()[2].frame_rate_hz);
  costs.note_frame(frame_of(stream_id_of({0, 0})), 500, kSInNs);
  EXPECT_DOUBLE_EQ(costs.bytes_per_s(0)[0], 500 * costs.classes()[0].frame_rate_hz);
  EXPECT_GT(costs.bytes_per_s(1)[0], costs.bytes_per_s(0)[0]) << "estimated from its own class 2";
  const std::vector<double> before = costs.bytes_per_s(1);
  for (const StrandStream nowhere : {StrandStream{1, class_count}, StrandStream{2, 0}})
    costs.note_frame(frame_of(stream_id_of(nowhere)), 1'000'000, kSInNs);
  EXPECT_EQ(costs.bytes_per_s(1), before) << "of no class or codec";
}

TEST(StrandStreams, EveryClassOfEveryCodecHasAnIdOfItsOwn) {
  std::set<uint16_t> ids;
  for (size_t codec = 0; codec < kMaxServedCodecs; ++codec) {
    for (size_t strand_class = 0; strand_class < kStreamsPerCodec; ++strand_class) {
      const uint16_t id = stream_id_of({codec, strand_class});
      EXPECT_TRUE(ids.insert(id).second) << id;
      EXPECT_EQ(id & kPictureStreamBit, 0) << "that is a picture's";
      EXPECT_EQ(strand_stream_of(id).codec, codec);
      EXPECT_EQ(strand_stream_of(id).strand_class, strand_class);
    }
  }
  EXPECT_EQ(stream_id_of({0, 0}), 0) << "as viewers of before know it";
}

// The figure of SECURITY.md.
TEST(StrandStreams, AreFew) {
  size_t most = 0;
  for (const double step_rate_hz : {10.0, 60.0, 240.0, 1'000.0})
    for (const float bound_m : {1e-6f, 2e-5f, 1e-4f, 5e-4f})
      for (const uint32_t strands : {1u, 500u, 200'000u})
        most = std::max(most, make_strand_classes({step_rate_hz, 0.0, bound_m, strands}).size());
  EXPECT_EQ(most, 9u);
  EXPECT_EQ(kMaxServedCodecs, 2u);
}

TEST(StrandCosts, AChangeShowsWithinASecond) {
  StrandCosts costs = costs_of_built_in();
  costs.note_frame(frame_of(0), 10'000, kSInNs);
  for (int i = 1; i <= 60; ++i) costs.note_frame(frame_of(0), 20'000, kSInNs + i * kStepNs);
  EXPECT_NEAR(costs.bytes_per_s(0)[0], 20'000 * 60.0, 0.05 * 20'000 * 60.0);
}

TEST(PictureCosts, AreBytesTimesRateWhileThePictureChanges) {
  PictureCosts costs;
  EXPECT_EQ(costs.bytes_per_s(7), 0.0);
  costs.note_picture(7, 500'000, kSInNs);
  EXPECT_EQ(costs.bytes_per_s(7), 0.0) << "the first one is whole";
  for (int i = 1; i <= 5; ++i) costs.note_picture(7, 8'000, kSInNs + i * kSInNs / 20);
  EXPECT_NEAR(costs.bytes_per_s(7), 8'000 * 20.0, 1.0);
  costs.note_picture(7, 8'000, 30 * kSInNs);
  EXPECT_NEAR(costs.bytes_per_s(7), 8'000 * 20.0, 1.0) << "a pause is no lower rate";
  costs.note_picture(8, 1'000, 100 * kSInNs);
  EXPECT_EQ(costs.bytes_per_s(7), 0.0) << "forgotten after a minute";
  costs.note_picture(8, 1'000, 100 * kSInNs + kSInNs / 10);
  EXPECT_GT(costs.bytes_per_s(8), 0.0);
  costs.forget(8);
  EXPECT_EQ(costs.bytes_per_s(8), 0.0);
}

}  // namespace
}  // namespace strandcast::stream_costs_test
