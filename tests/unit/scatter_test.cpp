// Light scattered by hair in double precision: laws first, then values that were computed independently
// (hair index 1.55) and those that the papers and pbrt publish.
#include <cmath>
#include <numbers>
#include <random>

#include "common/render/scatter/artist_lobes.h"
#include "common/render/scatter/chiang.h"
#include "common/render/scatter/dual_scattering.h"
#include "common/render/scatter/lobe_tables.h"

namespace strandcast::scatter::scatter_test {
namespace {

constexpr double kIndex = kHairIndex;

double integral(double low, double high, int count, const auto& function) {
  const double step = (high - low) / count;
  double sum = 0.0;
  for (int i = 0; i < count; ++i) sum += function(low + (i + 0.5) * step);
  return sum * step;
}

TEST(FibreOptics, TheSectionReflectsWhatTheRayInSpaceDoes) {
  EXPECT_NEAR(fresnel(kIndex, 1.0), 0.0465206, 1e-7);
  EXPECT_NEAR(fresnel(kIndex, 0.0), 1.0, 1e-12);
  for (const double degrees : {0.0, 20.0, 50.0, 80.0})
    for (const double h : {0.0, 0.3, 0.8, 0.99}) {
      const double theta = degrees * kDegree;
      EXPECT_NEAR(section_fresnel(bravais_indices(kIndex, theta), h),
                  fresnel(kIndex, std::cos(theta) * std::sqrt(1.0 - h * h)), 1e-12)
          << degrees << ' ' << h;
    }
  EXPECT_NEAR(bravais_indices(kIndex, 0.0).perpendicular, 1.55, 1e-5);
  EXPECT_NEAR(bravais_indices(kIndex, 30 * kDegree).perpendicular, 1.69411, 1e-5);
  EXPECT_NEAR(bravais_indices(kIndex, 60 * kDegree).perpendicular, 2.57099, 1e-5);
}

TEST(FibreOptics, ALosslessFibreGivesBackAllLight) {
  for (const double degrees : {0.0, 30.0, 60.0, 80.0, 89.9})
    for (const double h : {0.0, -0.5, 0.9, 0.9999}) {
      const auto shares = lobe_shares({kIndex, degrees * kDegree, h, 0.0});
      EXPECT_NEAR(shares[0] + shares[1] + shares[2] + shares[3], 1.0, 1e-12) << degrees << ' ' << h;
    }
}

TEST(FibreOptics, SharesOfTheWaysHaveTheirValues) {
  const std::vector<std::pair<double, std::array<double, 4>>> rows{
      {0.0, {.046521, .909123, .042293, .002063}},
      {0.5, {.048140, .906038, .043617, .002206}},
      {std::sqrt(0.75), {.097344, .814788, .079315, .008553}}};
  for (const auto& [h, expected] : rows) {
    const auto shares = lobe_shares({kIndex, 0.0, h, 0.0});
    for (size_t p = 0; p < kLobes; ++p) EXPECT_NEAR(shares[p], expected[p], 2e-6) << h << ' ' << p;
  }
}

TEST(FibreOptics, MeansOverTheFibreHaveTheirValues) {
  struct Row {
    double degrees, r, tt, trt, at_a_fifth, at_one;
  };
  for (const Row& row : {Row{0, .07495, .86179, .05567, .69838, .21129},
                         {30, .08618, .84277, .06142, .68276, .20261},
                         {60, .17347, .69735, .10201, .65417, .24029},
                         {80, .48968, .27305, .12312, .71338, .51103}}) {
    const auto mean = [&](double absorption, size_t first, size_t last) {
      return mean_over_h(20'000, [&](double h) {
        const auto shares = lobe_shares({kIndex, row.degrees * kDegree, h, absorption});
        double sum = 0.0;
        for (size_t p = first; p <= last; ++p) sum += shares[p];
        return sum;
      });
    };
    EXPECT_NEAR(mean(0.0, 0, 0), row.r, 1e-5);
    EXPECT_NEAR(mean(0.0, 1, 1), row.tt, 1e-5);
    EXPECT_NEAR(mean(0.0, 2, 2), row.trt, 1e-5);
    EXPECT_NEAR(mean(0.2, 0, 3), row.at_a_fifth, 2e-5) << row.degrees;
    EXPECT_NEAR(mean(1.0, 0, 3), row.at_one, 2e-5) << row.degrees;
  }
}

TEST(Marschner, AzimuthalPartsHaveTheirValuesAtTheListedAngles) {
  const SmoothFibre fibre;
  const std::vector<double> phis{0, 30, 60, 90, 120, 150, 170, 180};
  const std::vector<double> r{.011630, .011255, .010423, .010127, .012168, .016942, .013460, 0};
  const std::vector<double> tt{0, 0, 0, .003441, .106322, .371039, .630014, .687957};
  for (size_t i = 0; i < phis.size(); ++i) {
    const double phi = phis[i] * kDegree;
    EXPECT_NEAR(azimuthal(0, fibre, 0.0, phi), r[i], 1e-6) << phis[i];
    EXPECT_NEAR(azimuthal(1, fibre, 0.0, phi), tt[i], 1e-6) << phis[i];
    EXPECT_NEAR(azimuthal(2, fibre, 0.0, phi), i == 0 ? .052983 : 0.0, 1e-6) << phis[i];
    // Reflection is where it is seen, and of the strength of F cos(phi / 2) / 4.
    const double h = std::sin(-phi / 2.0);
    if (i + 1 < phis.size()) {
      EXPECT_NEAR(azimuthal(0, fibre, 0.0, phi),
                  0.25 * std::cos(phi / 2.0) * fresnel(kIndex, std::sqrt(1.0 - h * h)), 1e-12);
    }
  }
  EXPECT_NEAR(azimuthal_exact(1, fibre, 0.0, 120 * kDegree), .11061, 1e-5);
  EXPECT_NEAR(azimuthal_exact(1, fibre, 0.0, 150 * kDegree), .38801, 1e-5);
  EXPECT_NEAR(azimuthal_exact(1, fibre, 0.0, 180 * kDegree), .64052, 1e-5);
  EXPECT_NEAR(azimuthal_exact(2, fibre, 0.0, 0.0), .05882, 1e-5);
  EXPECT_EQ(exit_roots(0, kIndex, 0.0).size(), 1u);
  EXPECT_EQ(exit_roots(1, kIndex, 0.0).size(), 0u);
  EXPECT_EQ(exit_roots(1, kIndex, 2.5).size(), 1u);
  EXPECT_EQ(exit_roots(2, kIndex, 0.0).size(), 3u);
}

TEST(Marschner, EveryRootLeavesAtTheAngleAskedFor) {
  for (const double index : {1.5, 1.7, 2.1, 3.0})
    for (size_t p = 0; p < 3; ++p)
      for (double phi = -3.1; phi < 3.2; phi += 0.07)
        for (const double gamma : exit_roots(p, index, phi))
          EXPECT_NEAR(wrapped(cubic_exit(p, index, gamma) - phi), 0.0, 1e-9)
              << index << ' ' << p << ' ' << phi;
}

TEST(Marschner, TheCubicStaysWithinTwoDegreesOfTheLawOfRefraction) {
  std::array<double, 3> worst{};
  for (size_t p = 1; p < 3; ++p)
    for (double gamma = -1.57; gamma < 1.57; gamma += 1e-3)
      worst[p] = std::max(worst[p],
                          std::abs(cubic_exit(p, kIndex, gamma) - exit_azimuth(p, kIndex, std::sin(gamma))));
  EXPECT_NEAR(worst[1] / kDegree, 1.07, 0.01);
  EXPECT_NEAR(worst[2] / kDegree, 2.15, 0.01);
}

// Whatever enters leaves somewhere: over the azimuth each part has the mean share of its way.
TEST(Marschner, AzimuthalPartsIntegrateToTheMeanShares) {
  const SmoothFibre fibre;
  const double turn = 2.0 * std::numbers::pi;
  EXPECT_NEAR(integral(0.0, turn, 40'000, [&](double phi) { return azimuthal(0, fibre, 0.0, phi); }), .07496,
              2e-5);
  EXPECT_NEAR(integral(0.0, turn, 40'000, [&](double phi) { return azimuthal(1, fibre, 0.0, phi); }), .86179,
              2e-5);
  const SmoothFibre dark{kIndex, 0.4, {}};
  EXPECT_NEAR(integral(0.0, turn, 40'000, [&](double phi) { return azimuthal(1, dark, 0.5, phi); }),
              mean_over_h(20'000,
                          [&](double h) {
                            return lobe_shares({kIndex, 0.5, h, 0.4})[1];
                          }),
              1e-4);
}

TEST(Marschner, TheCausticOfTrtIsWhereItShouldBeAndGoneAboveTwo) {
  const Caustic caustic = trt_caustic(kIndex);
  ASSERT_TRUE(caustic.exists);
  EXPECT_NEAR(caustic.gamma / kDegree, 45.30, 0.01);
  EXPECT_NEAR(caustic.phi / kDegree, 20.49, 0.01);
  EXPECT_FALSE(trt_caustic(2.001).exists);
  EXPECT_TRUE(trt_caustic(1.999).exists);
  // Entries on both sides of it leave on the same side.
  const auto exit = [&](double gamma) { return wrapped(cubic_exit(2, kIndex, gamma)); };
  EXPECT_LT(exit(caustic.gamma - 0.1), caustic.phi);
  EXPECT_LT(exit(caustic.gamma + 0.1), caustic.phi);
}

TEST(Marschner, TrtHasALobeOnEachSideInsteadOfInfinity) {
  const SmoothFibre fibre;
  const double phi_c = trt_caustic(kIndex).phi;
  for (double diff = 0.0; diff < 1.5; diff += 0.05)
    for (double phi = 0.0; phi <= std::numbers::pi; phi += 0.01) {
      const double value = azimuthal_trt(fibre, diff, phi);
      ASSERT_TRUE(std::isfinite(value) && value >= 0.0 && value < 0.5) << diff << ' ' << phi << ' ' << value;
      ASSERT_NEAR(azimuthal_trt(fibre, diff, -phi), value, 1e-9);
    }
  // On the caustic nothing of the plain term is left: k_G A(2, h_c) dh (g(0) + g(2 phi_c)).
  const CausticTerms terms;
  const Caustic caustic = trt_caustic(kIndex);
  const double c = std::asin(1.0 / kIndex);
  const double bend =
      96.0 * c / std::pow(std::numbers::pi, 3.0) * caustic.gamma / std::pow(std::cos(caustic.gamma), 2.0);
  const double width_h = std::min(0.5, 2.0 * std::sqrt(2.0 * terms.width / bend));
  EXPECT_NEAR(azimuthal_trt(fibre, 0.0, phi_c),
              2.5 * lobe_shares({kIndex, 0.0, caustic.h, 0.0})[2] * width_h *
                  (gaussian(terms.width, 0.0) + gaussian(terms.width, 2.0 * phi_c)),
              1e-9);
}

// Half of a Gaussian in the half angle: 1.955 / 2 of the light at 5 degrees, and so on.
TEST(Marschner, HalfOfTheGaussianKeepsTheLight) {
  const std::vector<std::pair<double, double>> rows{
      {5, 1.955}, {7.5, 1.90}, {10, 1.83}, {15, 1.65}, {20, 1.45}};
  for (const auto& [width, twice] : rows)
    EXPECT_NEAR(integral(-std::numbers::pi / 2, std::numbers::pi / 2, 20'000,
                         [&, w = width](double out) {
                           return longitudinal({0.0, w * kDegree}, out / 2) * std::pow(std::cos(out), 2.0) /
                                  std::pow(std::cos(out / 2), 2.0);
                         }),
                twice / 2.0, 0.004)
        << width;
}

// Two entries beside the caustic leave together: where Phi falls by w_c, they are dh = 2 sqrt(2 w_c /
// |Phi''|) apart.
TEST(Marschner, TheWidthOfTheCausticFollowsFromItsCurvature) {
  SmoothFibre fibre;
  fibre.caustic.max_width_h = 10.0;
  const Caustic caustic = trt_caustic(kIndex);
  constexpr double kStep = 1e-4;
  const auto exit = [](double h) { return wrapped(cubic_exit(2, kIndex, std::asin(h))); };
  const double bend =
      (exit(caustic.h + kStep) - 2.0 * exit(caustic.h) + exit(caustic.h - kStep)) / (kStep * kStep);
  const double width_h = 2.0 * std::sqrt(2.0 * fibre.caustic.width / std::abs(bend));
  EXPECT_NEAR(azimuthal_trt(fibre, 0.0, caustic.phi),
              fibre.caustic.power * lobe_shares({kIndex, 0.0, caustic.h, 0.0})[2] * width_h *
                  (gaussian(fibre.caustic.width, 0.0) + gaussian(fibre.caustic.width, 2.0 * caustic.phi)),
              1e-5);
}

TEST(Marschner, ShiftsAndWidthsAreInTheRatiosOfThePaper) {
  const auto shapes = lobe_shapes(0.2, -0.1);
  EXPECT_EQ(shapes[0].shift, -0.1);
  EXPECT_NEAR(shapes[1].shift, 0.05, 1e-12);
  EXPECT_NEAR(shapes[2].shift, 0.15, 1e-12);
  EXPECT_EQ(shapes[0].width, 0.2);
  EXPECT_NEAR(shapes[1].width, 0.1, 1e-12);
  EXPECT_NEAR(shapes[2].width, 0.4, 1e-12);
}

TEST(Marschner, AnEllipticFibreHasAnotherIndexAcrossEachOfItsAxes) {
  EXPECT_NEAR(elliptic_index(kIndex, 1.0, 0.7), kIndex, 1e-12);
  EXPECT_NEAR(elliptic_index(kIndex, 0.9, 0.0), 2.0 * 0.55 * 0.81 + 0.45, 1e-12);
  EXPECT_NEAR(elliptic_index(kIndex, 0.9, std::numbers::pi / 2), 2.0 * 0.55 / 0.81 + 0.45, 1e-12);
}

TEST(KajiyaKay, HasItsPublishedValues) {
  const auto at = [](double degrees) {
    return glm::dvec3(std::cos(degrees * kDegree), std::sin(degrees * kDegree), 0.0);
  };
  const auto specular = [&](double eye) { return kajiya_kay_specular({{1, 0, 0}, at(60), at(eye)}, 20.0); };
  EXPECT_NEAR(specular(120), 1.0, 1e-12);
  EXPECT_NEAR(specular(110), 0.736257, 1e-6);
  EXPECT_NEAR(specular(60), 1e-6, 1e-6);
  EXPECT_NEAR(kajiya_kay_diffuse({{1, 0, 0}, at(60), at(0)}), 0.866025, 1e-6);
  // TressFX's two highlights for a light straight across: 20 degrees to the root, 30 degrees to the tip.
  const double cone = 10.0 * kDegree;
  const auto highlight = [&](double turn, double eye) {
    return turned_highlight({{1, 0, 0}, at(90), at(eye)}, turn, 20.0);
  };
  EXPECT_NEAR(highlight(-2.0 * cone, 110), 1.0, 1e-9);
  EXPECT_NEAR(highlight(3.0 * cone, 60), 1.0, 1e-9);
  EXPECT_LT(highlight(-2.0 * cone, 105), 0.95);
  EXPECT_LT(highlight(3.0 * cone, 65), 0.95);
}

TEST(Karis, StaysNearTheFibreItFits) {
  const auto fit = [](double degrees, double cos_diff = 1.0) {
    const double c = std::cos(degrees * kDegree);
    return karis_azimuthal(glm::dvec3(1.0), cos_diff, c, c);
  };
  const SmoothFibre fibre;
  EXPECT_NEAR(fit(180).tt.x, .6536, 1e-4);
  EXPECT_NEAR(fit(150).tt.x, .4008, 1e-4);
  EXPECT_NEAR(fit(120).tt.x, .1023, 1e-4);
  EXPECT_NEAR(fit(90).tt.x, .0074, 1e-4);
  EXPECT_NEAR(fit(0).trt.x, .0811, 1e-4);
  const double tt = 2.0 * integral(0.0, 180.0, 720, [&](double phi) { return fit(phi).tt.x; }) * kDegree;
  EXPECT_NEAR(tt, .86179, 0.1 * .86179) << "integral of TT";
  EXPECT_NEAR(fit(180).tt.x, azimuthal_exact(1, fibre, 0.0, std::numbers::pi), 0.05 * .64052) << "peak of TT";
  // Beyond, where Schlick's Fresnel and the exact one part at grazing angles, R is off by up to a quarter.
  for (const double phi : {0.0, 30.0, 60.0, 90.0, 150.0})
    EXPECT_NEAR(fit(phi).r / azimuthal(0, fibre, 0.0, phi * kDegree), 1.0, 0.2) << phi;
  // It is off by nothing else: incidence is half the azimuth.
  for (const double phi : {0.0, 60.0, 120.0, 150.0})
    EXPECT_NEAR(fit(phi).r / azimuthal(0, fibre, 0.0, phi * kDegree),
                schlick_fresnel(fibre.index, std::cos(0.5 * phi * kDegree)) /
                    fresnel(fibre.index, std::cos(0.5 * phi * kDegree)),
                1e-6)
        << phi;
  EXPECT_NEAR(fit(120).r / azimuthal(0, fibre, 0.0, 120 * kDegree), 0.78, 0.005);
  EXPECT_NEAR(karis_index_in_section(1.0), 1.5500, 1e-4);
  EXPECT_NEAR(karis_index_in_section(std::cos(30 * kDegree)), 1.6859, 1e-4);
  EXPECT_NEAR(karis_index_in_section(0.5), 2.5600, 1e-4);
}

TEST(Chiang, SpotValuesAreThoseOfPbrt) {
  const RoughFibre fibre;
  const auto at = [&](const FibreAngles& angles, double h) {
    const auto lobes = rough_lobes(fibre, angles, h);
    return lobes[0] + lobes[1] + lobes[2] + lobes[3];
  };
  EXPECT_NEAR(at({0, 0, 0}, 0.1), .091762, 1e-6);
  EXPECT_NEAR(at({0.2, -0.1, std::numbers::pi}, 0.0), 2.952336, 1e-6);
  EXPECT_NEAR(at({-0.3, 0.2, 2.0}, 0.5), .015669, 1e-6);
  EXPECT_NEAR(at({0.1, 0.1, 0.5}, -0.7), .000261, 1e-6);
  const std::vector<std::pair<double, double>> far{{0, .03408},   {30, .02034},  {60, .01481}, {90, .03734},
                                                   {120, .23645}, {150, .67563}, {180, .98169}};
  for (const auto& [phi, expected] : far)
    EXPECT_NEAR(rough_far_field(fibre, {0, 0, phi * kDegree}), expected, 1e-4 * expected + 1e-5) << phi;
}

TEST(Chiang, RoughnessHasItsPublishedMeaning) {
  const std::vector<std::pair<double, double>> rows{
      {.1, .006516}, {.3, .084611}, {.5, .320360}, {.7, .826340}, {.9, 3.100958}};
  for (const auto& [roughness, variance] : rows)
    EXPECT_NEAR(longitudinal_variance(roughness), variance, 1e-6);
  EXPECT_NEAR(azimuthal_scale(0.3), .117160, 1e-6);
}

TEST(Chiang, EachPartOfALobeIntegratesToOne) {
  for (const double variance : {0.003, 0.0846, 0.5, 3.1})
    for (const double out : {0.0, 0.4, -1.2, 1.5})
      EXPECT_NEAR(integral(-std::numbers::pi / 2, std::numbers::pi / 2, 40'000,
                           [&](double in) { return rough_longitudinal(variance, in, out) * std::cos(in); }),
                  1.0, 1e-4)
          << variance << ' ' << out;
  for (const double scale : {0.05, 0.117, 1.0})
    EXPECT_NEAR(integral(-std::numbers::pi, std::numbers::pi, 20'000,
                         [&](double x) { return trimmed_logistic(scale, x); }),
                1.0, 1e-6);
}

// The white furnace: a fibre that absorbs nothing shows as much light as comes from all around.
TEST(Chiang, AWhiteFibreVanishesInAWhiteFurnace) {
  RoughFibre fibre;
  fibre.absorption = 0.0;
  fibre.tilt = 0.0;
  for (const double roughness : {0.1, 0.3, 0.5, 0.7, 0.9})
    for (const double out : {0.0, 0.7}) {
      fibre.along = roughness;
      const double sum = integral(-std::numbers::pi / 2, std::numbers::pi / 2, 240, [&](double in) {
        return std::cos(in) * integral(-std::numbers::pi, std::numbers::pi, 240, [&](double phi) {
                 const auto lobes = rough_lobes(fibre, {in, out, phi}, 0.37);
                 return lobes[0] + lobes[1] + lobes[2] + lobes[3];
               });
      });
      EXPECT_NEAR(sum, 1.0, 2e-3) << roughness << ' ' << out;
    }
}

// The smooth models lose light at their rims, and more the wider they are.
TEST(Marschner, AWhiteFibreIsNotBrighterThanItsFurnace) {
  const SmoothFibre fibre;
  for (const double width : {5.0, 10.0}) {
    const auto shapes = lobe_shapes(width * kDegree, 0.0);
    const double sum = integral(-std::numbers::pi / 2, std::numbers::pi / 2, 180, [&](double in) {
      return std::cos(in) * integral(-std::numbers::pi, std::numbers::pi, 361, [&](double phi) {
               const auto lobes = marschner_lobes(fibre, shapes, in, 0.0, phi);
               return lobes[0] + lobes[1] + lobes[2];
             });
    });
    EXPECT_LT(sum, 1.10) << width << ": the caustics put some back twice";
    EXPECT_GT(sum, 0.80) << width;
  }
}

TEST(DualScattering, AveragesOfAFibreHaveTheirValues) {
  struct Row {
    double absorption, forward, back, albedo;
  };
  // Summed to the eighth way there: a few parts in 10,000 less.
  for (const Row& row : {Row{0, .79066, .20918, .45748},
                         {.05, .72232, .18989, .23980},
                         {.2, .55307, .14531, .06684},
                         {.5, .33115, .09364, .01166},
                         {1, .15376, .05753, .00140},
                         {2, .05719, .03924, .00013}}) {
    const auto averages =
        fibre_averages({kIndex, row.absorption, {}}, lobe_shapes(7.5 * kDegree, -7 * kDegree), 0.0);
    EXPECT_NEAR(averages.forward, row.forward, 1e-4) << row.absorption;
    EXPECT_NEAR(averages.back, row.back, 1e-4) << row.absorption;
    EXPECT_NEAR(back_scatter(averages).albedo, row.albedo, 1e-3 * row.albedo + 1e-5) << row.absorption;
    EXPECT_GT(back_scatter(averages).width, 0.0);
    if (row.absorption == 0.0) {
      EXPECT_NEAR(averages.forward + averages.back, 1.0, 3e-4);
      EXPECT_NEAR(forward_transmittance(averages, 5.0), .21630, 1e-4);
    }
  }
}

TEST(DualScattering, ShiftAndWidthFollowTheirEquations) {
  const FibreAverages averages{0.5, 0.2, 0.03, -0.1, 0.07, 0.12};
  const BackScatter back = back_scatter(averages);
  // With 1 - a_f^2 = 0.75.
  EXPECT_NEAR(back.albedo, 0.2 * 0.25 / 0.75 + 0.008 * 0.25 / 0.421875, 1e-12);
  EXPECT_NEAR(back.shift, -0.1 * (1.0 - 0.08 / 0.5625) + 0.03 * (2.0 * 0.5625 + 4.0 * 0.25 * 0.04) / 0.421875,
              1e-12);
  EXPECT_NEAR(back.width,
              (1.0 + 0.7 * 0.25) *
                  (0.2 * std::sqrt(2.0 * 0.0049 + 0.0144) + 0.008 * std::sqrt(2.0 * 0.0049 + 3.0 * 0.0144)) /
                  (0.2 + 0.008 * (2.0 * 0.07 + 3.0 * 0.12)),
              1e-12);
  EXPECT_NEAR(back_lobe(back, back.shift, 1.0, 0.0),
              back.albedo / (std::numbers::pi * back.width * std::sqrt(2.0 * std::numbers::pi)), 1e-12);
  EXPECT_LT(back_lobe(back, back.shift, 1.0, 0.01), back_lobe(back, back.shift, 1.0, 0.0));
}

// The number of strands in the way is a matter of chance about its mean.
TEST(DualScattering, TheMeanTransmittanceIsThatOfAPoissonCrowd) {
  for (const double forward : {0.0, 0.3, 0.9, 1.0})
    for (const double mean : {0.0, 0.5, 4.0}) {
      double sum = 0.0, chance = std::exp(-mean);
      for (int count = 0; count < 60; ++count) {
        sum += chance * std::pow(forward, count);
        chance *= mean / (count + 1);
      }
      EXPECT_NEAR(mean_transmittance(forward, mean), sum, 1e-12) << forward << ' ' << mean;
      EXPECT_GE(mean_transmittance(forward, mean), std::exp(-mean)) << "some of it met none";
    }
}

TEST(DualScattering, ForwardAzimuthsAreTheMeanOfTheBackHalf) {
  const SmoothFibre fibre{kIndex, 0.1, {}};
  for (size_t p = 0; p < 2; ++p)
    EXPECT_NEAR(forward_azimuthal(p, fibre, 0.3),
                2.0 / std::numbers::pi *
                    integral(std::numbers::pi / 2, std::numbers::pi, 20'000,
                             [&](double phi) { return azimuthal(p, fibre, 0.3, phi); }),
                2e-3 * forward_azimuthal(p, fibre, 0.3));
  EXPECT_GT(forward_azimuthal(1, fibre, 0.3), 10.0 * forward_azimuthal(0, fibre, 0.3)) << "TT goes on";
}

TEST(DensityNormal, PointsOutOfTheDensityAndHasAFallback) {
  const glm::dvec3 up(0, 1, 0);
  const glm::dvec3 normal = density_normal({3.0, 0.0, -4.0}, 1.0, up);
  EXPECT_NEAR(glm::length(normal - glm::dvec3(-0.6, 0.0, 0.8)), 0.0, 1e-12);
  EXPECT_EQ(density_normal({0.0, 0.5, 0.0}, 1.0, up), up);
  EXPECT_EQ(density_normal(glm::dvec3(0.0), 1.0, up), up);
}

// Directions along the strand, into each other and opposite: no model may give what is no number.
TEST(Scatter, DegenerateDirectionsStayFinite) {
  const glm::dvec3 x(1, 0, 0), y(0, 1, 0);
  const auto shapes = lobe_shapes(7.5 * kDegree, -7 * kDegree);
  for (const StrandView& view :
       {StrandView{x, x, x}, {x, -x, x}, {x, -x, -x}, {x, x, y}, {x, y, y}, {x, y, -y}}) {
    const StrandAngles angles = angles_of(view);
    ArtistLobes artist;
    artist.shapes = shapes;
    for (const double value :
         sadeghi_lobes(artist, {0.99 * angles.theta_in, 0.99 * angles.theta_out, angles.phi}))
      EXPECT_TRUE(std::isfinite(value));
    for (const double value : marschner_lobes({}, shapes, angles.theta_in, angles.theta_out, angles.phi))
      EXPECT_TRUE(std::isfinite(value));
    EXPECT_TRUE(std::isfinite(rough_far_field({}, {angles.theta_in, angles.theta_out, angles.phi})));
    EXPECT_TRUE(std::isfinite(kajiya_kay_specular(view, 20.0)));
  }
}

TEST(LobeTables, HoldOnlyNumbers) {
  const auto shapes = lobe_shapes(7.5 * kDegree, -7 * kDegree);
  for (const LookupTable& table :
       {make_longitudinal_table(shapes), make_azimuthal_table({}), make_average_table(shapes, {})}) {
    ASSERT_EQ(table.texels.size(), size_t{table.size.x} * table.size.y * table.size.z);
    constexpr uint64_t kHalfExponent = 0x7c00;
    for (const uint64_t texel : table.texels)
      for (int channel = 0; channel < 4; ++channel)
        ASSERT_NE((texel >> (16 * channel)) & kHalfExponent, kHalfExponent) << "infinite or no number";
  }
}

}  // namespace
}  // namespace strandcast::scatter::scatter_test
