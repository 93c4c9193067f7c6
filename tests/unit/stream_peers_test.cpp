// The peers of the streaming report: what comes back from each library, what our prediction around them
// keeps, and what happens to bytes that are not theirs.
#include "server/report/peers/peer_codecs.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "server/report/peers/frame_order.h"
#include "server/report/peers/temporal_predictor.h"

namespace strandcast::stream_peers_test {
namespace {

constexpr double kBoundM = 1e-4;
constexpr double kFloatRoundingM = 0x1p-25;  // half a step of a float below 1 m

/// Strands that swing smoothly, with noise of some bounds' size and one jump of some centimetres.
class Swinging {
 public:
  explicit Swinging(StreamShape shape) : shape_(std::move(shape)) {}

  static StreamShape shape() {
    StreamShape shape{37, 9, {}};
    std::mt19937 random(5);
    std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
    for (size_t i = 0; i < shape.plane_size(); ++i) {
      const float down = 0.03f * static_cast<float>(i / shape.strand_count);
      shape.rest_in_head_m.emplace_back(0.1f * unit(random), 0.1f - down, 0.1f * unit(random));
    }
    return shape;
  }
  StreamFrame next() {
    const float time = 0.1f * static_cast<float>(++frame_);
    StreamFrame frame;
    for (size_t i = 0; i < shape_.plane_size(); ++i) {
      const auto strand = static_cast<float>(i % shape_.strand_count);
      const glm::vec3 swing(0.05f * std::sin(time + strand), 0.01f * std::cos(2.0f * time), 0.0f);
      const glm::vec3 noise(unit_(random_), unit_(random_), unit_(random_));
      const glm::vec3 jump(frame_ > 7 ? 0.03f : 0.0f, 0.0f, 0.0f);
      frame.position_in_head_m.push_back(shape_.rest_in_head_m[i] + swing + 2e-4f * noise + jump);
    }
    return frame;
  }

 private:
  StreamShape shape_;
  int frame_ = 0;
  std::mt19937 random_{9};
  std::uniform_real_distribution<float> unit_{-1.0f, 1.0f};
};

double largest_error_m(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b) {
  EXPECT_EQ(a.size(), b.size());
  double largest = 0.0;
  for (size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    largest = std::max(largest, glm::distance(glm::dvec3(a[i]), glm::dvec3(b[i])));
  return largest;
}

std::vector<StreamCodecRow> all_peers() {
  std::vector<StreamCodecRow> rows = peer_stream_codecs(kBoundM);
  for (StreamCodecRow& row : bound_free_stream_codecs()) rows.push_back(std::move(row));
  return rows;
}

TEST(StreamPeers, KeepTheBoundOfEveryVertex) {
  const StreamShape shape = Swinging::shape();
  for (const StreamCodecRow& row : all_peers()) {
    auto codec = row.make(shape);
    ASSERT_TRUE(codec.ok()) << row.name;
    Swinging motion(shape);
    for (int i = 0; i < 14; ++i) {
      const StreamFrame frame = motion.next();
      ASSERT_TRUE((*codec)->take(frame).ok()) << row.name;
      const auto message = (*codec)->encode();
      ASSERT_TRUE(message.ok()) << row.name << ": " << message.error().to_string();
      const Status status = (*codec)->decode(*message);
      ASSERT_TRUE(status.ok()) << row.name << ": " << status.error().to_string();
      EXPECT_LE(largest_error_m((*codec)->decoded(), frame.position_in_head_m), row.bound_m + kFloatRoundingM)
          << row.name << ", frame " << i;
    }
    const StreamFrame last = motion.next();
    const auto join_bytes = (*codec)->join_bytes(last);
    ASSERT_TRUE(join_bytes.ok()) << row.name;
    EXPECT_GT(*join_bytes, 0u) << row.name;
  }
}

// Decoded positions that are nearer than half a lattice step can guarantee would mean that nothing is
// rounded.
TEST(StreamPeers, UseTheRoomThatTheBoundLeaves) {
  const StreamShape shape = Swinging::shape();
  for (const StreamCodecRow& row : peer_stream_codecs(kBoundM)) {
    auto codec = row.make(shape);
    ASSERT_TRUE(codec.ok());
    Swinging motion(shape);
    const StreamFrame frame = motion.next();
    ASSERT_TRUE((*codec)->take(frame).ok());
    const auto message = (*codec)->encode();
    ASSERT_TRUE(message.ok());
    ASSERT_TRUE((*codec)->decode(*message).ok());
    // Of 333 points in a cube at least one lies beyond half the way to a corner; zfp's tolerances are powers
    // of two and its errors smaller than those.
    EXPECT_GT(largest_error_m((*codec)->decoded(), frame.position_in_head_m), 0.2 * kBoundM) << row.name;
  }
}

TEST(StreamPeers, RefuseBytesThatAreNotTheirs) {
  const StreamShape shape = Swinging::shape();
  for (const StreamCodecRow& row : all_peers()) {
    if (row.name.starts_with("zfp")) continue;  // its stream has no frame that could be wrong
    auto codec = row.make(shape);
    ASSERT_TRUE(codec.ok());
    EXPECT_FALSE((*codec)->decode({}).ok()) << row.name;
    const std::vector<std::byte> nonsense(100, std::byte{0x5a});
    EXPECT_FALSE((*codec)->decode(nonsense).ok()) << row.name;
  }
}

TEST(StreamPeers, EveryLibraryTakesPartOrIsNamedAsMissing) {
  EXPECT_EQ(peer_stream_codecs(kBoundM).size() + 2 * missing_peers().size(), 6u);
}

IntegerPlanes random_planes(std::mt19937& random, int32_t limit) {
  IntegerPlanes planes{13, 7, {}};
  std::uniform_int_distribution<int32_t> value(-limit, limit);
  planes.value.resize(3 * planes.plane_size());
  for (int32_t& number : planes.value) number = value(random);
  return planes;
}

TEST(TemporalPredictor, RestoresWhatItTookAway) {
  std::mt19937 random(3);
  TemporalPredictor encoder;
  TemporalPredictor decoder;
  for (int i = 0; i < 6; ++i) {
    const IntegerPlanes now = random_planes(random, i == 4 ? 1 << 20 : 1'000);
    const TemporalWeights weights = encoder.fit(now);
    const IntegerPlanes residual = encoder.residual(now, weights);
    EXPECT_EQ(decoder.restored(residual, weights).value, now.value) << "frame " << i;
    encoder.advance(now);
    decoder.advance(now);
  }
}

TEST(TemporalPredictor, ForetellsSteadyMovement) {
  std::mt19937 random(4);
  const IntegerPlanes start = random_planes(random, 10'000);
  const IntegerPlanes step = random_planes(random, 500);
  TemporalPredictor predictor;
  IntegerPlanes now = start;
  for (int i = 0; i < 4; ++i) {
    if (i >= 2) {
      const IntegerPlanes residual = predictor.residual(now, predictor.fit(now));
      for (size_t k = 0; k < residual.value.size(); ++k)
        EXPECT_LE(std::abs(residual.value[k]), 1) << "frame " << i << ", value " << k;
    }
    predictor.advance(now);
    for (size_t k = 0; k < now.value.size(); ++k)
      now.value[k] += k / now.strand_count % now.vertex_count == 0 ? 0 : step.value[k];
  }
}

// Strands that sway as one with their parents: only what the parent says foretells a sudden push.
TEST(TemporalPredictor, FollowsTheParent) {
  TemporalPredictor predictor;
  IntegerPlanes now{16, 5, {}};
  now.value.assign(3 * now.plane_size(), 0);
  std::mt19937 random(6);
  std::uniform_int_distribution<int32_t> push(-2'000, 2'000);
  int64_t moved = 0;
  int64_t left = 0;
  for (int i = 0; i < 8; ++i) {
    for (size_t axis = 0; axis < 3; ++axis)
      for (size_t s = 0; s < now.strand_count; ++s) {
        const int32_t by = push(random);
        for (size_t v = 0; v < now.vertex_count; ++v)
          now.value[axis * now.plane_size() + v * now.strand_count + s] += by;
      }
    const IntegerPlanes residual = predictor.residual(now, predictor.fit(now));
    for (size_t k = 0; i >= 3 && k < residual.value.size(); ++k) {
      if (k / now.strand_count % now.vertex_count == 0) continue;  // the roots' own moves come as a surprise
      left += std::abs(residual.value[k]);
      moved += 1'000;  // the mean of |push|
    }
    predictor.advance(now);
  }
  EXPECT_LT(left, moved / 50);
}

TEST(FrameOrder, SortsStrandsAndPutsThemBack) {
  const StreamShape shape = Swinging::shape();
  const FrameOrder order(shape);
  const std::vector<glm::vec3> sorted = order.sorted(shape.rest_in_head_m);
  EXPECT_EQ(order.restored(sorted), shape.rest_in_head_m);
  EXPECT_NE(sorted, shape.rest_in_head_m);
  // Roots that follow each other are nearer than in a random order, where the mean distance of two points in
  // a cube of side a is 0.66 a.
  double way_m = 0.0;
  for (size_t s = 1; s < shape.strand_count; ++s) way_m += glm::distance(sorted[s], sorted[s - 1]);
  EXPECT_LT(way_m / (shape.strand_count - 1), 0.5 * 0.66 * 0.2 + 0.02);
}

}  // namespace
}  // namespace strandcast::stream_peers_test
