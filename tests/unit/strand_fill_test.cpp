#include "common/replay/strand_fill.h"

#include <map>

#include "common/replay/strand_replay.h"
#include "common/strands/strand_prefix.h"
#include "tests/support/hair_motion.h"

namespace strandcast::strand_fill_test {
namespace {

constexpr uint32_t kStrands = 400;
constexpr uint32_t kVertices = 8;
constexpr float kQuantumM = 1e-6f;
constexpr float kBoundM = 1e-4f;

/// A snapshot of these positions.
Snapshot snapshot_of(std::span<const glm::vec3> position_in_head_m, int64_t sim_time_ns = 0) {
  QuantiseInput input;
  input.sim_time_ns = sim_time_ns;
  input.strand_count = kStrands;
  input.vertex_count = kVertices;
  input.quantum_m = kQuantumM;
  input.position_in_head_m = position_in_head_m;
  return quantise(input).snapshot;
}

class Fill : public testing::Test {
 protected:
  HairMotion hair_{{.strand_count = kStrands, .vertex_count = kVertices}};
  std::vector<glm::vec3> rest_ = hair_.rest_in_head();
  StrandFill fill_{rest_, kVertices};
};

TEST_F(Fill, WhatWasSentIsShownAsItIs) {
  hair_.step();
  const Snapshot all = snapshot_of(hair_.positions_in_head());
  EXPECT_EQ(fill_.positions(all), positions_in_head(all));
  const Snapshot sent = prefix_of(all, 100);
  const auto shown = fill_.positions(sent);
  ASSERT_EQ(shown.size(), rest_.size());
  EXPECT_EQ(prefix_of_shape(shown, kVertices, 100), positions_in_head(sent));
}

TEST_F(Fill, AtRestAndTurnedAsOneAllStrandsAreWhereTheyShouldBe) {
  const glm::quat turn = glm::angleAxis(0.8f, glm::normalize(glm::vec3(0.3f, 1.0f, -0.2f)));
  for (const glm::quat& rotation : {glm::quat(1.0f, 0.0f, 0.0f, 0.0f), turn}) {
    // Straight strands in one direction: then the shortest turn of a guide is the turn of all.
    std::vector<glm::vec3> rest = rest_;
    std::vector<glm::vec3> moved(rest.size());
    for (size_t v = 0; v < kVertices; ++v)
      for (size_t s = 0; s < kStrands; ++s) {
        const glm::vec3 along = 0.03f * static_cast<float>(v) * glm::vec3(0.0f, -1.0f, 0.0f);
        rest[v * kStrands + s] = rest_[s] + along;
        moved[v * kStrands + s] = rest_[s] + rotation * along;
      }
    StrandFill fill(rest, kVertices);
    const auto shown = fill.positions(prefix_of(snapshot_of(moved), 50));
    ASSERT_EQ(shown.size(), moved.size());
    for (size_t i = 0; i < moved.size(); ++i) EXPECT_LT(glm::distance(shown[i], moved[i]), 1e-5f) << i;
  }
}

TEST_F(Fill, SegmentsKeepTheirLengths) {
  for (int i = 0; i < 60; ++i) hair_.step();
  const auto shown = fill_.positions(prefix_of(snapshot_of(hair_.positions_in_head()), 50));
  for (size_t i = kStrands; i < shown.size(); ++i) {
    if (i % kStrands < 50) continue;
    EXPECT_NEAR(glm::distance(shown[i], shown[i - kStrands]), glm::distance(rest_[i], rest_[i - kStrands]),
                1e-6f);
  }
}

// The law that makes it worth while: nearer to the truth than leaving strands at rest, and the more strands
// are sent the nearer.
TEST_F(Fill, MoreStrandsAreNearerToTheTruth) {
  for (int i = 0; i < 90; ++i) hair_.step();
  const std::vector<glm::vec3> truth = hair_.positions_in_head();
  const auto mean_error_m = [&](const std::vector<glm::vec3>& shown) {
    double sum = 0.0;
    for (size_t i = 0; i < truth.size(); ++i) sum += glm::distance(shown[i], truth[i]);
    return sum / static_cast<double>(truth.size());
  };
  double last_m = mean_error_m(rest_);
  for (const uint32_t count : {50u, 100u, 200u, 400u}) {
    const double error_m = mean_error_m(fill_.positions(prefix_of(snapshot_of(truth), count)));
    EXPECT_LT(error_m, count == 50 ? 0.5 * last_m : last_m) << count;
    last_m = error_m;
  }
}

TEST_F(Fill, DegenerateShapesGiveFiniteNumbers) {
  for (const glm::vec3& point : {glm::vec3(0.0f), glm::vec3(90.0f)}) {
    const std::vector<glm::vec3> rest(rest_.size(), point);
    StrandFill fill(rest, kVertices);
    for (const auto& state : {rest, rest_, std::vector<glm::vec3>(rest_.size(), -point)})
      for (const glm::vec3& shown : fill.positions(prefix_of(snapshot_of(state), 1)))
        EXPECT_TRUE(std::isfinite(shown.x) && std::isfinite(shown.y) && std::isfinite(shown.z));
  }
  std::vector<glm::vec3> back = rest_;
  for (size_t i = kStrands; i < back.size(); ++i) back[i] = 2.0f * rest_[i % kStrands] - rest_[i];
  for (const glm::vec3& shown : fill_.positions(prefix_of(snapshot_of(back), 100)))
    EXPECT_TRUE(std::isfinite(shown.x) && std::isfinite(shown.y) && std::isfinite(shown.z));
}

TEST_F(Fill, WithoutARestShapeOnlyWhatWasSentIsThere) {
  StrandFill nothing;
  const Snapshot sent = prefix_of(snapshot_of(rest_), 100);
  EXPECT_EQ(nothing.positions(sent), positions_in_head(sent));
}

/// A server that changes to fewer strands and back, and a viewer that draws at times between its states.
TEST_F(Fill, PicturesKeepAllStrandsWhileTheStreamChanges) {
  for (const Playout playout : {Playout::LowLatency, Playout::Smooth}) {
    auto replay = std::move(*StrandReplay::make("tangent", {kStrands, kVertices}, {}));
    replay->set_rest_shape(rest_);
    replay->set_playout(playout);
    std::map<uint16_t, std::unique_ptr<StrandEncoder>> encoders;
    HairMotion hair({.strand_count = kStrands, .vertex_count = kVertices});
    const float quantum_m = lattice_step_m("tangent", kBoundM).value();
    constexpr int64_t kStepNs = 16'666'667;
    std::vector<glm::vec3> last, last_truth;
    float largest_step_m = 0.0f, largest_true_step_m = 0.0f, longest_excess_m = 0.0f;
    for (int i = 0; i < 60; ++i) {
      hair.step();
      const uint16_t stream_id = i / 10 % 2 == 0 ? 0 : 2;  // all strands and a quarter, in turn
      auto& encoder = encoders[stream_id];
      if (i % 10 == 0) {
        encoder = std::move(*make_strand_encoder("tangent"));
        encoder->set_rest_shape(rest_);
      }
      const Snapshot truth = hair.snapshot(quantum_m);
      const auto frame = encoder->encode(stream_id == 0 ? truth : prefix_of(truth, kStrands / 4));
      ASSERT_TRUE(replay->receive(with_send_time(*frame, stream_id, 1)->message, i * kStepNs, {}));
      const auto strands = replay->strands_at(i * kStepNs + kStepNs / 3);
      ASSERT_TRUE(strands);
      const std::vector<glm::vec3>& shown = strands->position_m;
      ASSERT_EQ(shown.size(), rest_.size()) << "never fewer strands, frame " << i;
      const std::vector<glm::vec3> true_m = hair.positions_in_head();
      for (size_t k = 0; k < shown.size(); ++k) {
        if (k >= kStrands) {
          const float rest_length_m = glm::distance(rest_[k], rest_[k - kStrands]);
          longest_excess_m =
              std::max(longest_excess_m, glm::distance(shown[k], shown[k - kStrands]) - rest_length_m);
        }
        if (last.empty() || k % kStrands >= kStrands / 4) continue;  // these are in both streams
        largest_step_m = std::max(largest_step_m, glm::distance(shown[k], last[k]));
        largest_true_step_m = std::max(largest_true_step_m, glm::distance(true_m[k], last_truth[k]));
      }
      last = shown;
      last_truth = true_m;
    }
    EXPECT_EQ(replay->stats().rejected_frames, 0u);
    EXPECT_LE(longest_excess_m, 3.0f * kBoundM) << "no strand is torn";
    // Smooth playout may show up to two steps in one.
    EXPECT_LE(largest_step_m, 2.0f * largest_true_step_m + 2.0f * kBoundM)
        << "strands in both streams do not jump";
  }
}

}  // namespace
}  // namespace strandcast::strand_fill_test
