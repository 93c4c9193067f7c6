// What joiners are told of velocities beside what is expected of them: the head's motion, neighbours that are
// turned to a strand's own edges, and weights that are fitted.
#include "common/strands/step/velocity_guess.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <random>

#include "common/strands/step/component.h"

namespace strandcast::step {
namespace {

constexpr uint32_t kStrands = 300;
constexpr uint32_t kVertices = 8;
constexpr uint32_t kPinned = 1;

using Vectors = std::vector<glm::vec3>;  // (vertex_count x strand_count), strand fastest

/// Straight strands, each in a direction of its own, and their velocities.
class Hair {
 public:
  /// direction(strand) is a unit vector.
  template <class Direction>
  explicit Hair(Direction direction) {
    constexpr float kSegmentM = 0.02f, kApartM = 0.01f;
    for (uint32_t v = 0; v < kVertices; ++v)
      for (uint32_t strand = 0; strand < kStrands; ++strand) {
        const glm::vec3 root(kApartM * static_cast<float>(strand % 20), 1.5f,
                             kApartM * static_cast<float>(strand / 20));
        position_m_.push_back(root + static_cast<float>(v) * kSegmentM * direction(strand));
      }
    layout_ = tangent::make_layout(kStrands, kVertices, position_m_);
    position_ = blocks_of(position_m_);
  }

  const glm::vec3& position_m(uint32_t strand, uint32_t v) const {
    return position_m_[v * kStrands + strand];
  }
  StrandBlocks blocks_of(const Vectors& vectors) const {
    StrandBlocks blocks(layout_.no_neighbour(), kVertices);
    for (uint32_t v = 0; v < kVertices; ++v)
      for (uint32_t strand = 0; strand < kStrands; ++strand)
        for (uint32_t axis = 0; axis < 3; ++axis)
          at(blocks, layout_.place_of[strand], v, axis) =
              vectors[v * kStrands + strand][static_cast<int>(axis)];
    return blocks;
  }
  GuessedVelocities guessed(const glm::mat3& turn_per_s,
                            simd::InstructionSet set = simd::widest_set()) const {
    return GuessedVelocities({layout_, layout_.alike, position_, turn_per_s, kVertices, kPinned, set});
  }
  std::vector<int32_t> no_steps() const {
    return std::vector<int32_t>(3 * layout_.no_neighbour() * kVertices);
  }
  /// Steps of velocities beside the guess, in the mean, of strands with neighbours from this vertex on.
  double mean_step(const VelocityGuess& guess, const Vectors& velocity_mps, const glm::mat3& turn_per_s,
                   uint32_t first) const {
    std::vector<int32_t> steps = no_steps();
    StrandBlocks velocity = blocks_of(velocity_mps);
    guessed(turn_per_s).settle(guess, velocity, steps);
    double sum = 0.0;
    size_t count = 0;
    for (const uint32_t place : layout_.place_of)
      for (uint32_t v = first; v < kVertices; ++v)
        for (size_t i = 0; i < 3; ++i) {
          if (layout_.alike[1][place] == layout_.no_neighbour()) continue;
          sum += std::abs(steps[3 * (place * kVertices + v) + i]);
          ++count;
        }
    return sum / static_cast<double>(count);
  }
  glm::vec3 settled_mps(const StrandBlocks& velocity, uint32_t strand, uint32_t v) const {
    return vector_at(velocity, layout_.place_of[strand], v);
  }
  VelocityGuess fit(const Vectors& velocity_mps, const glm::mat3& turn_per_s) const {
    return guessed(turn_per_s).fit(blocks_of(velocity_mps));
  }

 private:
  Vectors position_m_;
  tangent::Layout layout_;
  StrandBlocks position_;
};

/// Numbers from -1 to 1.
class Numbers {
 public:
  float next() { return std::uniform_real_distribution<float>(-1.0f, 1.0f)(random_); }
  glm::vec3 vector() { return {next(), next(), next()}; }

 private:
  std::mt19937 random_{7};
};

Hair any_hair() {
  Numbers numbers;
  return Hair([directions = Vectors(), numbers](uint32_t strand) mutable {
    while (directions.size() <= strand) directions.push_back(glm::normalize(numbers.vector()));
    return directions[strand];
  });
}

constexpr double kNextToNothing = 0.7;  // roundings of what is expected
constexpr double kMuch = 3.0;

TEST(VelocityGuess, TellsTheHeadsMotionByItself) {
  const Hair hair = any_hair();
  const glm::mat3 turn_per_s(0.0f, 2.0f, 1.0f, -2.0f, 0.0f, 3.0f, -1.0f, -3.0f, 0.0f);
  Vectors velocity_mps;
  for (uint32_t v = 0; v < kVertices; ++v)
    for (uint32_t strand = 0; strand < kStrands; ++strand)
      velocity_mps.push_back(glm::vec3(1.0f, -0.5f, 0.25f) + turn_per_s * hair.position_m(strand, v));
  const VelocityGuess guess = hair.fit(velocity_mps, turn_per_s);
  EXPECT_TRUE(guess.are_roots_carried);
  EXPECT_LT(hair.mean_step(guess, velocity_mps, turn_per_s, 0), 0.01);
  const glm::mat3 none(0.0f);
  const VelocityGuess without = hair.fit(velocity_mps, none);
  EXPECT_FALSE(without.are_roots_carried);
  EXPECT_GT(hair.mean_step(without, velocity_mps, none, 0), kMuch);
}

/// Strands that lean otherwise and move the same way beside their own edges. The counter-example moves the
/// same way in the world.
TEST(VelocityGuess, TellsWhatNeighboursDoTurnedToTheStrandsOwnEdges) {
  Numbers numbers;
  std::vector<glm::mat3> lean;
  for (uint32_t strand = 0; strand < kStrands; ++strand)
    lean.emplace_back(glm::rotate(glm::mat4(1.0f), numbers.next(), glm::vec3(1.0f, 0.0f, 0.0f)));
  const Hair hair([&](uint32_t strand) { return lean[strand][1]; });
  Vectors turned_mps(kStrands * kVertices), same_mps(kStrands * kVertices);
  for (uint32_t v = kPinned; v < kVertices; ++v) {
    const glm::vec3 change_mps = 0.4f * numbers.vector();
    for (uint32_t strand = 0; strand < kStrands; ++strand) {
      const size_t i = v * kStrands + strand;
      turned_mps[i] = turned_mps[i - kStrands] + lean[strand] * change_mps;
      same_mps[i] = same_mps[i - kStrands] + change_mps;
    }
  }
  const glm::mat3 none(0.0f);
  EXPECT_LT(hair.mean_step(hair.fit(turned_mps, none), turned_mps, none, kPinned), kNextToNothing);
  EXPECT_GT(hair.mean_step(hair.fit(same_mps, none), same_mps, none, kPinned), kMuch);
}

/// Changes of velocity across each strand that go on by shares that nobody knows.
TEST(VelocityGuess, FitsHowVelocitiesGoOn) {
  constexpr uint32_t kFree = 3;  // vertices that the others follow
  const Hair hair = any_hair();
  Numbers numbers;
  Vectors velocity_mps(kStrands * kVertices);
  for (uint32_t strand = 0; strand < kStrands; ++strand) {
    const glm::vec3 along = glm::normalize(hair.position_m(strand, 1) - hair.position_m(strand, 0));
    std::array<glm::vec3, kFree> before{};  // the last one first
    for (uint32_t v = kPinned; v < kVertices; ++v) {
      const glm::vec3 change_mps = v < kPinned + kFree
                                       ? glm::cross(along, numbers.vector())
                                       : 0.5f * before[0] + 0.4f * before[1] - 0.3f * before[2];
      velocity_mps[v * kStrands + strand] = velocity_mps[(v - 1) * kStrands + strand] + change_mps;
      before = {change_mps, before[0], before[1]};
    }
  }
  const glm::mat3 none(0.0f);
  const VelocityGuess guess = hair.fit(velocity_mps, none);
  VelocityGuess unfitted = guess;
  unfitted.across = {};
  unfitted.along = {};
  const double fitted_step = hair.mean_step(guess, velocity_mps, none, kPinned + kFree);
  EXPECT_LT(20.0 * fitted_step, hair.mean_step(unfitted, velocity_mps, none, kPinned + kFree));
}

TEST(VelocityGuess, LeavesAnyVelocityWithinAMillimetreASecondOnEveryInstructionSet) {
  constexpr float kMostApartMps = 1e-3f;
  const Hair hair = any_hair();
  Numbers numbers;
  Vectors velocity_mps;
  for (size_t i = 0; i < size_t{kStrands} * kVertices; ++i) velocity_mps.push_back(numbers.vector());
  const glm::mat3 none(0.0f);
  const StrandBlocks wanted = hair.blocks_of(velocity_mps);
  std::vector<std::byte> first_guess;
  std::vector<int32_t> first_steps;
  std::vector<float> first_placed;
  for (const simd::InstructionSet set : simd::instruction_sets()) {
    const VelocityGuess guess = hair.guessed(none, set).fit(wanted);
    std::vector<std::byte> bytes;
    guess.write(bytes);
    std::vector<int32_t> steps = hair.no_steps();
    StrandBlocks settled = hair.blocks_of(velocity_mps);
    hair.guessed(none, set).settle(guess, settled, steps);
    StrandBlocks placed = hair.blocks_of(Vectors(velocity_mps.size()));
    hair.guessed(none, set).place(guess, steps, placed);
    const std::vector<float> values(placed.data(), placed.data() + placed.size());
    EXPECT_TRUE(std::equal(values.begin(), values.end(), settled.data())) << to_string(set);
    for (uint32_t strand = 0; strand < kStrands; ++strand)
      for (uint32_t v = 0; v < kVertices; ++v)
        ASSERT_LE(glm::distance(hair.settled_mps(placed, strand, v), velocity_mps[v * kStrands + strand]),
                  kMostApartMps);
    if (first_steps.empty()) {
      first_guess = bytes;
      first_steps = steps;
      first_placed = values;
    }
    EXPECT_EQ(bytes, first_guess) << to_string(set);
    EXPECT_EQ(steps, first_steps) << to_string(set);
    EXPECT_EQ(values, first_placed) << to_string(set);
  }
}

}  // namespace
}  // namespace strandcast::step
