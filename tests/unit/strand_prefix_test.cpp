// Streams of the first strands only: what they decode to, that one decoder follows a stream that changes its
// number of strands, and that no number it is told makes it trust more than it should.
#include "common/strands/strand_prefix.h"

#include <cstring>

#include "common/strands/strand_codec.h"
#include "tests/support/hair_motion.h"

namespace strandcast::strand_prefix_test {
namespace {

constexpr float kBoundM = 1e-4f;
constexpr uint32_t kStrands = 1'200;  // enough for several slices, and for one in an eighth of them
constexpr uint32_t kVertices = 6;

double largest_error_m(const std::vector<glm::vec3>& truth, const Snapshot& decoded) {
  const auto shown = positions_in_head(decoded);
  double largest = shown.size() == truth.size() ? 0.0 : INFINITY;
  for (size_t i = 0; i < std::min(truth.size(), shown.size()); ++i)
    largest = std::max(largest, glm::distance(glm::dvec3(truth[i]), glm::dvec3(shown[i])));
  return largest;
}

class StrandPrefix : public testing::TestWithParam<std::string> {
 protected:
  StrandPrefix() {
    encoder_->set_rest_shape(hair_.rest_in_head());
    decoder_->set_rest_shape(hair_.rest_in_head());
  }
  Snapshot step() {
    hair_.step();
    return hair_.snapshot(lattice_step_m(GetParam(), kBoundM).value());
  }
  std::vector<glm::vec3> truth(uint32_t count) const {
    return prefix_of_shape(hair_.positions_in_head(), kVertices, count);
  }

  HairMotion hair_{{kStrands, kVertices, MotionKind::Extreme}};
  std::unique_ptr<StrandEncoder> encoder_ = std::move(*make_strand_encoder(GetParam()));
  std::unique_ptr<StrandDecoder> decoder_ =
      std::move(*make_strand_decoder(GetParam(), {kStrands, kVertices}));
};

TEST_P(StrandPrefix, EveryShareIsWithinTheBoundForItsStrandsUpAndDown) {
  uint32_t previous = 0;
  for (const float share : {1.0f, 0.5f, 0.25f, 0.125f, 0.5f, 1.0f}) {
    const uint32_t count = prefix_count(kStrands, share);
    ASSERT_NE(count, previous);
    for (int i = 0; i < 8; ++i) {
      const Snapshot sent = prefix_of(step(), count);
      const EncodedFramePtr frame = encoder_->encode(sent);
      ASSERT_NE(frame, nullptr);
      EXPECT_EQ(frame->header.opcode == Opcode::StrandKeyframe, i == 0 || GetParam() == "raw") << i;
      const auto decoded = decoder_->decode(frame->message);
      ASSERT_TRUE(decoded) << decoded.error().to_string();
      EXPECT_EQ((*decoded)->strand_count, count);
      EXPECT_LE(largest_error_m(truth(count), **decoded), kBoundM) << share;
    }
    previous = count;
  }
}

TEST_P(StrandPrefix, TheHashIsThatOfTheStrandsThatWereSent) {
  const uint32_t count = prefix_count(kStrands, 0.25f);
  const Snapshot sent = prefix_of(step(), count);
  const auto decoded = decoder_->decode(encoder_->encode(sent)->message);
  ASSERT_TRUE(decoded);
  Snapshot same = **decoded;
  EXPECT_EQ(state_hash(same), state_hash(**decoded));
  EXPECT_TRUE(GetParam() == "tangent" || state_hash(same) == state_hash(sent))
      << "a codec that rounds nothing";
  ++same.strand_count;
  EXPECT_NE(state_hash(same), state_hash(**decoded)) << "the number of strands is part of it";
}

TEST_P(StrandPrefix, LateJoinersAndFollowersHaveTheSameState) {
  auto late = std::move(*make_strand_decoder(GetParam(), {kStrands, kVertices}));
  late->set_rest_shape(hair_.rest_in_head());
  const uint32_t count = prefix_count(kStrands, 0.5f);
  ASSERT_TRUE(decoder_->decode(encoder_->encode(prefix_of(step(), count))->message));
  const JoinFrames frames = encoder_->encode_for_join(prefix_of(step(), count));
  const auto followed = decoder_->decode(frames.frame->message);
  const auto joined = late->decode(frames.keyframe->message);
  ASSERT_TRUE(followed && joined);
  EXPECT_EQ(state_hash(**followed), state_hash(**joined));
  const EncodedFramePtr next = encoder_->encode(prefix_of(step(), count));
  EXPECT_TRUE(late->decode(next->message));
}

// A keyframe that lies about its strands leaves the decoder as it was.
TEST_P(StrandPrefix, WrongNumbersChangeNothing) {
  ASSERT_TRUE(decoder_->decode(encoder_->encode(step())->message));
  const EncodedFramePtr good = encoder_->encode_for_join(step()).frame;
  constexpr size_t kCountAt = kFrameHeaderBytes + 8;
  const EncodedFramePtr keyframe = encoder_->encode_for_join(step()).keyframe;
  for (const uint32_t count : {0u, 1u, kStrands / 2, kStrands - 1, kStrands + 1, 0xffffffffu}) {
    std::vector<std::byte> lying = keyframe->message;
    std::memcpy(lying.data() + kCountAt, &count, sizeof count);
    EXPECT_FALSE(decoder_->decode(lying)) << count;
  }
  if (GetParam() == "raw") return;  // every frame stands alone
  EXPECT_TRUE(decoder_->decode(good->message)) << "the chain goes on where it was";
}

INSTANTIATE_TEST_SUITE_P(Codecs, StrandPrefix, testing::Values("raw", "delta", "tangent"),
                         [](const auto& codec) { return codec.param; });

TEST(PrefixCount, IsNeverNothingAndNeverMoreThanAll) {
  for (const uint32_t strands : {1u, 2u, 7u, 1'000u, 200'000u})
    for (const float share : {1e-6f, 0.125f, 0.25f, 0.5f, 1.0f}) {
      const uint32_t count = prefix_count(strands, share);
      EXPECT_GE(count, 1u);
      EXPECT_LE(count, strands);
      EXPECT_GE(static_cast<double>(count), static_cast<double>(share) * strands) << "rounded up";
    }
  EXPECT_EQ(prefix_count(2'001, 0.25f), 501u);
}

TEST(PrefixOfShape, IsNothingForWhatIsNoSuchShape) {
  const std::vector<glm::vec3> shape(12, glm::vec3(1.0f));
  EXPECT_EQ(prefix_of_shape(shape, 4, 2).size(), 8u);
  EXPECT_TRUE(prefix_of_shape(shape, 5, 2).empty());
  EXPECT_TRUE(prefix_of_shape(shape, 4, 4).empty());
  EXPECT_TRUE(prefix_of_shape({}, 4, 1).empty());
}

}  // namespace
}  // namespace strandcast::strand_prefix_test
