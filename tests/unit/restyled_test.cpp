// Other lengths and curls of hair from a file.
#include "common/groom/restyled.h"

#include <gtest/gtest.h>

#include <cmath>

namespace strandcast::restyled_test {
namespace {

constexpr uint32_t kVertices = 48;
constexpr float kPathLengthM = 0.3f;
constexpr float kTwoPi = 6.2831853f;

/// Strands that fall in an arc of 0.25 m radius, waved about it.
Groom waved_hair(float wave_m, float wavelength_m, Pinning pinning = Pinning::RootPair) {
  Groom groom;
  groom.offset = {0};
  for (int strand = 0; strand < 3; ++strand) {
    for (uint32_t i = 0; i < kVertices; ++i) {
      const float along_m = kPathLengthM * static_cast<float>(i) / (kVertices - 1);
      const float angle = along_m / 0.25f;
      const float open = std::min(along_m / 0.06f, 1.0f);
      const float wave = wave_m * open * std::sin(kTwoPi * along_m / wavelength_m);
      groom.rest_position_m.emplace_back(0.25f * (1.0f - std::cos(angle)), -0.25f * std::sin(angle),
                                         0.05f * static_cast<float>(strand) + wave);
    }
    groom.offset.push_back(static_cast<uint32_t>(groom.rest_position_m.size()));
  }
  return with_pinning(std::move(groom), pinning);
}

/// Root mean square of the way from the smooth path, behind where waves open, m.
double waviness_m(const Groom& groom) {
  double sum = 0.0;
  uint32_t count = 0;
  for (uint32_t strand = 0; strand < groom.strand_count(); ++strand) {
    const auto path = smooth_path_of(groom, strand);
    for (uint32_t i = kVertices / 4; i < kVertices; ++i, ++count) {
      const glm::dvec3 off = glm::dvec3(groom.rest_position_m[groom.offset[strand] + i]) - path[i];
      sum += glm::dot(off, off);
    }
  }
  return std::sqrt(sum / count);
}

TEST(Restyled, OneAndOneIsTheGroomItself) {
  const Groom groom = waved_hair(0.005f, 0.05f);
  EXPECT_EQ(restyled(groom, 1.0, 1.0).rest_position_m, groom.rest_position_m);
}

TEST(Restyled, LengthIsThatOfTheStrands) {
  const Groom groom = waved_hair(0.005f, 0.05f);
  for (const double length : {0.3, 0.5, 0.8, 1.2, 1.5}) {
    const Groom other = restyled(groom, length, 1.0);
    ASSERT_TRUE(validate(other));
    for (uint32_t strand = 0; strand < groom.strand_count(); ++strand) {
      EXPECT_NEAR(other.length_m(strand), length * groom.length_m(strand),
                  0.01 * length * groom.length_m(strand));
      EXPECT_EQ(other.rest_position_m[groom.offset[strand]], groom.rest_position_m[groom.offset[strand]])
          << "the root stays";
    }
  }
}

// What is cut ends earlier on the same way.
TEST(Restyled, ShorterHairLiesWhereItLay) {
  const Groom groom = waved_hair(0.005f, 0.05f);
  const Groom cut = restyled(groom, 0.5, 1.0);
  for (uint32_t i = 0; i < kVertices; ++i) {
    float nearest_m = 1.0f;
    for (uint32_t k = 0; k < kVertices; ++k)
      nearest_m = std::min(nearest_m, glm::distance(cut.rest_position_m[i], groom.rest_position_m[k]));
    EXPECT_LT(nearest_m, 0.5f * groom.length_m(0) / (kVertices - 1) + 1e-3f) << i;
  }
}

TEST(Restyled, WithoutCurlTheWavesAreGoneAndThePathIsThere) {
  const Groom waved = waved_hair(0.005f, 0.04f);
  const Groom path = waved_hair(0.0f, 0.04f);
  const Groom combed = restyled(waved, 1.0, 0.0);
  EXPECT_LT(waviness_m(combed), 0.1 * waviness_m(waved));
  EXPECT_GT(waviness_m(restyled(waved, 1.0, 2.0)), 1.5 * waviness_m(waved));
  EXPECT_NEAR(waviness_m(restyled(waved, 1.0, 0.5)), 0.5 * waviness_m(waved), 0.1 * waviness_m(waved));
  // Of an arc as wide as a head little is taken for a wave.
  for (size_t i = 0; i < path.rest_position_m.size(); ++i)
    EXPECT_LT(glm::distance(combed.rest_position_m[i], path.rest_position_m[i]),
              i % kVertices < kVertices - 4 ? 2e-3f : 4e-3f)
        << i << ", with no hair beyond the tip to say where the path goes";
  EXPECT_EQ(combed.rest_position_m[1], waved.rest_position_m[1]) << "what is pinned stays";
}

TEST(Restyled, WhatIsHeldAtBothEndsKeepsItsLength) {
  const Groom held = waved_hair(0.005f, 0.05f, Pinning::BothEnds);
  EXPECT_EQ(restyled(held, 0.5, 1.0).rest_position_m, held.rest_position_m);
  EXPECT_NE(restyled(held, 1.0, 0.0).rest_position_m, held.rest_position_m) << "but not its curls";
}

TEST(Restyled, StrandsOfTwoVerticesAndOfNoLengthStayFinite) {
  Groom groom;
  groom.offset = {0, 2, 5};
  groom.rest_position_m = {{0, 0, 0}, {0, -0.1f, 0}, {1, 0, 0}, {1, 0, 0}, {1, 0, 0}};
  groom = with_pinning(std::move(groom), Pinning::Root);
  for (const double length : {0.3, 1.5})
    for (const double curl : {0.0, 2.0}) EXPECT_TRUE(validate(restyled(groom, length, curl)));
}

}  // namespace
}  // namespace strandcast::restyled_test
