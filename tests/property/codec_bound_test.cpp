// The promise of the "tangent" codec over a hundred thousand frames (a seventh on the small grid): every
// vertex of every frame within the announced bound, and joiners in the same state as everybody else, whatever
// moves.
#include <array>
#include <limits>
#include <random>

#include "common/strands/strand_codec.h"
#include "server/sim/solver_registry.h"
#include "tests/bench/codec_motions.h"
#include "tests/support/test_grid.h"

namespace strandcast::codec_bound_test {
namespace {

constexpr std::array kBoundsM = {2e-5f, 5e-5f, 1e-4f, 5e-4f};

/// A stream with somebody who has been there from its beginning and somebody who joined lately.
class Stream {
 public:
  Stream(const Snapshot& first, std::span<const glm::vec3> rest, float bound_m)
      : limits_{first.strand_count, first.vertex_count}, rest_(rest), bound_m_(bound_m) {
    encoder_->set_rest_shape(rest_);
    everybody_->set_rest_shape(rest_);
  }

  /// One frame, with a joiner when wanted; `truth` is what the snapshot was made from.
  void pass(const Snapshot& snapshot, std::span<const glm::vec3> truth, bool has_joiner) {
    const JoinFrames frames =
        has_joiner ? encoder_->encode_for_join(snapshot) : JoinFrames{encoder_->encode(snapshot), nullptr};
    const auto decoded = everybody_->decode(frames.frame->message);
    ASSERT_TRUE(decoded) << decoded.error().to_string();
    const auto shown = positions_in_head(**decoded);
    for (size_t i = 0; i < truth.size(); ++i)
      largest_m_ = std::max(largest_m_, glm::distance(glm::dvec3(truth[i]), glm::dvec3(shown[i])));
    if (has_joiner) {
      joiner_ = std::move(*make_strand_decoder("tangent", limits_));
      joiner_->set_rest_shape(rest_);
    }
    if (joiner_ == nullptr) return;
    const auto joined = joiner_->decode((has_joiner ? frames.keyframe : frames.frame)->message);
    ASSERT_TRUE(joined) << joined.error().to_string();
    ASSERT_EQ(state_hash(**joined), state_hash(**decoded));
  }

  float quantum_m() const { return lattice_step_m("tangent", bound_m_).value(); }
  double bound_m() const { return bound_m_; }
  double largest_m() const { return largest_m_; }

 private:
  StrandStreamLimits limits_;
  std::span<const glm::vec3> rest_;
  float bound_m_;
  std::unique_ptr<StrandEncoder> encoder_ = std::move(*make_strand_encoder("tangent"));
  std::unique_ptr<StrandDecoder> everybody_ = std::move(*make_strand_decoder("tangent", limits_));
  std::unique_ptr<StrandDecoder> joiner_;
  double largest_m_ = 0.0;
};

/// Things that befall a groom, one at a time, for a while.
enum class Event { None, Teleported, Stretched, Collapsed, NotANumber, Frozen };

void befall(Event event, std::mt19937& random, const std::vector<glm::vec3>& rest,
            std::vector<glm::vec3>& points) {
  const auto below = [&random](size_t count) { return random() % count; };
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  if (event == Event::Teleported)
    for (glm::vec3& point : points) point += glm::vec3(1.2f, -1.3f, 0.7f);
  if (event == Event::Stretched)
    for (size_t i = below(5); i < points.size(); i += 5) points[i] *= 2.5f;
  if (event == Event::Collapsed)
    for (size_t i = below(3); i < points.size(); i += 3) points[i] = points[0];
  if (event == Event::NotANumber) {
    points[below(points.size())].x = kNan;
    points[below(points.size())] = glm::vec3(kInfinity, 0.0f, -kInfinity);
  }
  // What the publisher does with such vertices.
  for (size_t i = 0; i < points.size(); ++i)
    if (!glm::all(glm::lessThan(glm::abs(points[i]), glm::vec3(kInfinity)))) points[i] = rest[i];
}

HairMotionDesc random_hair(std::mt19937& random) {
  std::uniform_real_distribution<double> far_m(-100.0, 100.0);
  HairMotionDesc desc;
  desc.strand_count = 1 + random() % 16;
  desc.vertex_count = 2 + random() % 7;
  desc.kind = static_cast<MotionKind>(random() % 4);
  desc.curl_radius_m = static_cast<float>(random() % 3) * 0.005f;
  desc.origin_m = {far_m(random), far_m(random), far_m(random)};
  desc.seed = random();
  return desc;
}

TEST(CodecBound, HoldsForEveryVertexOfEveryFrame) {
  const int groom_count = on_grid(12, 84);
  constexpr int kFrames = 1'200;
  std::mt19937 random(20240607);
  double largest_share = 0.0;
  for (int groom = 0; groom < groom_count; ++groom) {
    const HairMotionDesc desc = random_hair(random);
    HairMotion hair(desc);
    const float bound_m = kBoundsM[static_cast<size_t>(groom) % kBoundsM.size()];
    Stream stream(hair.snapshot(1e-6f), hair.rest_in_head(), bound_m);
    Event event = Event::None;
    int left = 0;
    for (int i = 0; i < kFrames; ++i) {
      if (left-- == 0) {
        event = random() % 2 == 0 ? Event::None : static_cast<Event>(random() % 6);
        left = event == Event::None ? 40 : static_cast<int>(random() % 12);
      }
      if (event != Event::Frozen) hair.step();
      std::vector<glm::vec3> points = hair.positions_in_head();
      befall(event, random, hair.rest_in_head(), points);
      QuantiseInput input;
      input.tick = static_cast<uint64_t>(i + 1);
      input.world_from_head = hair.head_pose(hair.time_s());
      input.strand_count = desc.strand_count;
      input.vertex_count = desc.vertex_count;
      input.quantum_m = stream.quantum_m();
      input.position_in_head_m = points;
      ASSERT_NO_FATAL_FAILURE(stream.pass(quantise(input).snapshot, points, random() % 50 == 0));
      ASSERT_LE(stream.largest_m(), stream.bound_m()) << "groom " << groom << ", frame " << i;
    }
    largest_share = std::max(largest_share, stream.largest_m() / stream.bound_m());
  }
  EXPECT_GE(largest_share, 0.95) << "the bound is there to be used";
}

TEST(CodecBound, HoldsForEveryModelOnTheBuiltInMotion) {
  std::mt19937 random(7);
  int frames = 0;
  for (const SolverRow& row : solver_table()) {
    const auto recording = record_simulation({row.name, 40, 8, {}, 0.0}, {60, 90});
    ASSERT_TRUE(recording) << recording.error().to_string();
    for (const float bound_m : kBoundsM) {
      Stream stream(recording->states[0], recording->rest_in_head_m, bound_m);
      for (const Snapshot& state : recording->states) {
        const std::vector<glm::vec3> truth = positions_in_head(state);
        ASSERT_NO_FATAL_FAILURE(
            stream.pass(on_lattice(state, stream.quantum_m()), truth, random() % 30 == 0));
        ASSERT_LE(stream.largest_m(), stream.bound_m()) << row.name;
        ++frames;
      }
    }
  }
  EXPECT_GE(frames, 4'000);
}

}  // namespace
}  // namespace strandcast::codec_bound_test
