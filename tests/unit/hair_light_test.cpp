// Energy of the law by which tiles light hair, against the reference of Chiang et al. 2016 in double
// precision.
#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <numbers>

#include "common/render/laws.h"
#include "common/render/scatter/chiang.h"

namespace strandcast::hair_light_test {
namespace {

constexpr double kPi = std::numbers::pi;
// Absorption from colour by Chiang et al. 2016 for azimuthal roughness 0.3, as the law has it.
constexpr double kColorFit = 5.8884;

enum Lobe { kR, kTt, kTrt, kLobes };

struct Fibre {
  double color = 1.0;
  double width_deg = 7.5;
  double tilt_deg = 3.5;
  float wetness = 0.0f;
  std::array<float, kLobes> weight{1.0f, 1.0f, 1.0f};
};

law::HairLook look_of(const Fibre& fibre) {
  law::HairLook look{};
  look.highlight = fibre.weight[kR];
  look.transmission = fibre.weight[kTt];
  look.second_highlight = fibre.weight[kTrt];
  look.width = static_cast<float>(fibre.width_deg * kPi / 180.0);
  look.wetness = fibre.wetness;
  return look;
}

/// Share of the light of this inclination that the lobes send on in all directions.
double share_sent_on(const Fibre& fibre, double theta_in) {
  using simd::Float, simd::kLanes;
  const law::HairLook look = look_of(fibre);
  const law::StrandShares shares =
      law::strand_shares(law::vec3(static_cast<float>(fibre.color)), look.wetness);
  const law::vec3 tangent(0.0f, 1.0f, 0.0f);
  const auto direction = [](double theta, double phi) {
    return law::vec3(static_cast<float>(std::cos(theta) * std::cos(phi)), static_cast<float>(std::sin(theta)),
                     static_cast<float>(std::cos(theta) * std::sin(phi)));
  };
  const law::vec3 to_light = direction(theta_in, 0.0);
  constexpr int kInclinations = 360;
  constexpr int kAzimuths = 90;
  double sum = 0.0;
  for (int i = 0; i < kInclinations; ++i) {
    const double theta = kPi * ((i + 0.5) / kInclinations - 0.5);
    for (int j = 0; j < kAzimuths; ++j) {
      const law::vec3 to_eye =
          direction(theta, kPi * (j + 0.5) / kAzimuths);  // half of them: alike on both sides
      const law::StrandAngles angles = law::strand_angles(tangent, to_light, to_eye);
      const law::vec3 sent = law::hair_lobes(look, static_cast<float>(fibre.tilt_deg * kPi / 180.0), shares,
                                             angles, law::dot(to_light, to_eye));
      // A fibre is seen as wide as the cosine of its inclination says, and so is the light that meets it.
      sum += std::cos(theta) * std::cos(theta) * static_cast<double>(sent.x.v[0]);
    }
  }
  return 2.0 * sum * (kPi / kInclinations) * (kPi / kAzimuths) / kPi / std::cos(theta_in);
}

/// Likewise, of one lobe of the reference, for light from across.
double reference_share(double color, Lobe lobe) {
  scatter::RoughFibre fibre;
  const double log_color = std::log(color) / kColorFit;
  fibre.absorption = log_color * log_color;
  constexpr int kOffsets = 4000;
  return scatter::mean_over_h(kOffsets, [&](double h) {
    return scatter::lobe_shares({fibre.index, 0.0, h, fibre.absorption})[lobe];
  });
}

TEST(HairLight, ItsExponentialAndLogarithmAreCloseEnough) {
  for (double x = -80.0; x < 60.0; x += 0.0137)
    EXPECT_NEAR(law::light_exp(simd::Float(x)).v[0] / std::exp(double{static_cast<float>(x)}), 1.0, 1e-4)
        << x;
  EXPECT_LT(law::light_exp(simd::Float(-1e30f)).v[0], 1e-30f);
  for (double x = 1e-6; x < 1e3; x *= 1.0037)
    EXPECT_NEAR(law::light_log2(simd::Float(x)).v[0], std::log2(double{static_cast<float>(x)}), 2e-5) << x;
}

TEST(HairLight, ALobeSendsOnWhatChiangsDoes) {
  for (const double color : {0.0115, 0.0625, 0.094, 0.34, 0.4, 0.7})
    for (const Lobe lobe : {kR, kTt, kTrt}) {
      Fibre fibre;
      fibre.color = color;
      fibre.weight = {};
      fibre.weight[lobe] = 1.0f;
      const double expected = reference_share(color, lobe);
      EXPECT_NEAR(share_sent_on(fibre, 0.0), expected, 0.15 * expected)
          << "colour " << color << ", lobe " << lobe;
    }
}

TEST(HairLight, NoFibreGivesBackMoreThanItGets) {
  for (const double color : {0.01, 0.5, 1.0})
    for (const double width_deg : {1.0, 7.5, 20.0, 45.0})
      for (const float wetness : {0.0f, 1.0f})
        for (const double theta_deg : {-80.0, -50.0, -20.0, 0.0, 35.0, 65.0, 85.0}) {
          const double share =
              share_sent_on({color, width_deg, 3.5, wetness, {1.0f, 1.0f, 1.0f}}, theta_deg * kPi / 180.0);
          EXPECT_LT(share, 1.01) << color << " " << width_deg << " deg, light at " << theta_deg;
          EXPECT_GT(share, 0.0);
        }
  // Weights that an artist raises do.
  EXPECT_GT(share_sent_on({1.0, 7.5, 3.5, 0.0f, {4.0f, 2.0f, 4.0f}}, 0.0), 1.5);
}

// d'Eon et al. 2011, equation 7, in double precision: also where both light and eye look along the strand.
TEST(HairLight, LobesAreAsHighAsTheirConeSays) {
  const auto direction = [](double theta) {
    return law::vec3(static_cast<float>(std::cos(theta)), static_cast<float>(std::sin(theta)), 0.0f);
  };
  for (const double variance : {0.017, 0.0685, 0.274})
    for (const double theta_deg : {0.0, 30.0, 60.0, 75.0})
      for (const double off_deg : {0.0, -6.0, 6.0}) {
        const double theta = theta_deg * kPi / 180.0, other = -(theta_deg - off_deg) * kPi / 180.0;
        const law::StrandAngles angles =
            law::strand_angles(law::vec3(0.0f, 1.0f, 0.0f), direction(theta), direction(other));
        const law::Cone cone = law::light_cone(angles, 0.0f, static_cast<float>(variance));
        const double height = double{cone.height.v[0]} * std::exp(double{cone.exponent.v[0]});
        const double expected = scatter::rough_longitudinal(variance, theta, other);
        EXPECT_NEAR(height, expected, 0.1 * expected)
            << variance << ", " << theta_deg << " " << off_deg << " deg";
      }
}

TEST(HairLight, HairUnderAnEvenSkyIsNoBrighterThanTheSky) {
  constexpr float kWarmest = 1.06f;  // red comes by way of skin
  for (const float color : {0.001f, 0.05f, 0.2f, 0.5f, 0.8f, 1.0f})
    for (int degrees = 0; degrees < 90; degrees += 5) {
      law::HairLook look{};
      look.root_color = look.tip_color = law::vec3(color);
      look.width = 0.13f;
      const law::HairLights lights{law::vec3(0.0f, 0.0f, 1.0f),
                                   law::vec3(0.0f),
                                   law::vec3(0.0f, 0.0f, 1.0f),
                                   law::vec3(0.0f),
                                   false,
                                   law::vec3(0.0f, 0.0f, 1.0f),
                                   1.0f};
      const double theta = degrees * kPi / 180.0;
      const law::vec3 to_eye(0.0f, static_cast<float>(std::sin(theta)), static_cast<float>(std::cos(theta)));
      law::HairStrand hair{};
      hair.brightness = 1.0f;
      const law::vec3 seen = law::hair_radiance(look, hair, lights, {0.0f, 0.0f, 0.0f}, 0.5f,
                                                law::vec3(0.0f, 1.0f, 0.0f), to_eye);
      EXPECT_LE(seen.x.v[0], kWarmest) << color << ", seen at " << degrees << " deg";
    }
}

/// What is left of light that has crossed so many depths of hair, by colour.
law::vec3 lit_at(const law::vec3& color, float depth) {
  law::HairLook look{};
  look.scatter = 0.5f;
  look.diffuse = 0.42f;
  look.width = 0.13f;
  const law::vec3 tangent(0.0f, 1.0f, 0.0f);
  const law::vec3 across(0.6f, 0.0f, 0.8f);
  return law::hair_lit(look, 0.0f, law::strand_shares(color, 0.0f), tangent, law::vec3(0.0f, 0.0f, 1.0f),
                       across, depth);
}

TEST(HairLight, DepthTakesMoreOfTheDarkerColours) {
  const law::vec3 blond(0.5f, 0.34f, 0.17f);
  const law::vec3 near = lit_at(blond, 1.0f);
  const law::vec3 deep = lit_at(blond, 6.0f);
  const auto left = [](simd::Float far, simd::Float from) { return double{far.v[0] / from.v[0]}; };
  EXPECT_GT(left(deep.x, near.x), 1.2 * left(deep.y, near.y));
  EXPECT_GT(left(deep.y, near.y), 1.2 * left(deep.z, near.z));
  // Without a colour all is lost alike.
  const law::vec3 grey_near = lit_at(law::vec3(0.4f), 1.0f), grey_deep = lit_at(law::vec3(0.4f), 6.0f);
  EXPECT_NEAR(left(grey_deep.x, grey_near.x), left(grey_deep.z, grey_near.z), 1e-6);
}

// Of a lock of depth D, all within a cell, the lattice says D / 2 at every strand. Seen from where the light
// is, a strand with n in front of it counts exp(-n), so that seen strands get (1 + exp(-D)) / 2 of the light
// on average.
TEST(HairLight, StrandsThatAreSeenStandInFrontOfTheirLock) {
  constexpr double kCrossedPerDepth = 1.25;
  for (const double lock_depth : {1.0, 1.5, 2.0}) {
    const double expected = 0.5 + 0.5 * std::exp(-kCrossedPerDepth * lock_depth);
    const auto error = [&](double depth) { return std::abs(std::exp(-kCrossedPerDepth * depth) - expected); };
    const double mean_depth = 0.5 * lock_depth;
    const law::Float seen = law::key_depth_of_seen(static_cast<float>(mean_depth));
    EXPECT_LT(error(double{seen.v[0]}), 0.65 * error(mean_depth)) << lock_depth;
  }
  // What lies deep has all of the hair in front of it.
  for (const float depth : {3.0f, 4.0f, 5.0f})
    EXPECT_NEAR(law::key_depth_of_seen(depth).v[0], depth, 0.08f * depth);
  EXPECT_EQ(law::key_depth_of_seen(0.0f).v[0], 0.0f);
}

// A rim light from behind leaves a bright edge and dark hair inside: more of the light is lost between a
// depth of 1 and of 4 than a depth that counts whole would take.
TEST(HairLight, ARimIsBrightAtTheEdge) {
  const auto left = [](float depth) { return std::exp(-double{law::rim_depth_of_seen(depth).v[0]}); };
  EXPECT_GT(left(1.0f), 1.5 * std::exp(-1.0));
  EXPECT_LT(left(4.0f) / left(1.0f), std::exp(-2.6));
}

TEST(HairLight, WaterTakesLightOut) {
  const law::StrandShares dry = law::strand_shares(law::vec3(0.19f, 0.092f, 0.04f), 0.0f);
  const law::StrandShares wet = law::strand_shares(law::vec3(0.19f, 0.092f, 0.04f), 1.0f);
  EXPECT_LT(wet.around.x.v[0], 0.5f * dry.around.x.v[0]);
  EXPECT_EQ(wet.through.x.v[0], dry.through.x.v[0]);
}

}  // namespace
}  // namespace strandcast::hair_light_test
