// The exact values of work-precision against the equations they solve.
#include <cmath>
#include <numbers>

#include "server/report/exact_solutions.h"

namespace strandcast::exact_solutions_test {
namespace {

/// Tip of the heavy rod by shooting: theta'' = -gamma (1 - s) cos(theta) with theta measured downwards, so
/// theta'(1) = 0 is met by the start slope found by bisection; classical Runge-Kutta.
glm::dvec2 shot_tip(double gamma) {
  struct Rod {
    double angle, slope, x, y;
  };
  const auto rate = [gamma](double s, const Rod& r) {
    return Rod{r.slope, -gamma * (1.0 - s) * std::cos(r.angle), std::cos(r.angle), std::sin(r.angle)};
  };
  const auto add = [](const Rod& r, const Rod& k, double h) {
    return Rod{r.angle + h * k.angle, r.slope + h * k.slope, r.x + h * k.x, r.y + h * k.y};
  };
  const auto shoot = [&](double slope) {
    constexpr int kSteps = 4000;
    const double h = 1.0 / kSteps;
    Rod rod{0.0, slope, 0.0, 0.0};
    for (int i = 0; i < kSteps; ++i) {
      const double s = i * h;
      const Rod k1 = rate(s, rod);
      const Rod k2 = rate(s + 0.5 * h, add(rod, k1, 0.5 * h));
      const Rod k3 = rate(s + 0.5 * h, add(rod, k2, 0.5 * h));
      const Rod k4 = rate(s + h, add(rod, k3, h));
      rod = add(add(add(add(rod, k1, h / 6.0), k2, h / 3.0), k3, h / 3.0), k4, h / 6.0);
    }
    return rod;
  };
  double low = 0.0;
  double high = gamma;
  for (int i = 0; i < 80; ++i) {
    const double middle = 0.5 * (low + high);
    (shoot(middle).slope < 0.0 ? low : high) = middle;
  }
  const Rod rod = shoot(low);
  return {rod.x, rod.y};
}

TEST(ExactSolutions, CantileversSolveTheElastica) {
  // Shooting is stable for soft rods only; stiffer entries are checked by their order below.
  int count = 0;
  for (const CantileverShape& shape : cantilever_shapes()) {
    if (shape.gamma > 20.0) continue;
    const glm::dvec2 tip = shot_tip(shape.gamma);
    EXPECT_NEAR(shape.x, tip.x, 2e-6) << shape.gamma;
    EXPECT_NEAR(shape.y, tip.y, 2e-6) << shape.gamma;
    ++count;
  }
  EXPECT_GE(count, 9);
}

TEST(ExactSolutions, CantileversHangMoreTheHeavierTheyAre) {
  double before_x = 1.0, before_y = 0.0;
  for (const CantileverShape& shape : cantilever_shapes()) {
    EXPECT_LT(shape.x, before_x);
    EXPECT_GT(shape.y, before_y);
    EXPECT_LT(shape.x * shape.x + shape.y * shape.y, 1.0);
    before_x = shape.x;
    before_y = shape.y;
  }
  // A hair of no weight: y = gamma / 8.
  EXPECT_NEAR(cantilever_shapes().front().y / (cantilever_shapes().front().gamma / 8.0), 1.0, 1e-4);
  // A very heavy one hangs straight, moved out by the boundary layer 1 / sqrt(gamma).
  const CantileverShape& heavy = cantilever_shapes().back();
  EXPECT_NEAR(heavy.x * std::sqrt(heavy.gamma), std::numbers::sqrt2, 0.05);
}

TEST(ExactSolutions, ChainModesAreNoughtAtTheHeldEnd) {
  for (const int mode : {1, 2, 3}) {
    EXPECT_NEAR(chain_mode(0.0, mode), 0.0, 1e-12) << mode;
    EXPECT_EQ(chain_mode(1.0, mode), 1.0);
  }
  // Periods over sqrt(L / g), from the roots of J0.
  for (const auto& [mode, expected] : {std::pair{1, 5.225481}, {2, 2.276484}, {3, 1.452134}}) {
    const double period_s = 2.0 * std::numbers::pi / chain_frequency_radps(1.0, 1.0, mode);
    EXPECT_NEAR(period_s, expected, 1e-6) << mode;
  }
}

TEST(ExactSolutions, TheBeamModeKeepsTheBoundaryConditions) {
  const double beta = std::sqrt(kBeamBetaSquared);
  EXPECT_NEAR(std::cos(beta) * std::cosh(beta), -1.0, 1e-5);
  EXPECT_EQ(beam_mode(0.0), 0.0);
  constexpr double kStep = 1e-3;
  EXPECT_NEAR(beam_mode(kStep) / kStep, 0.0, 0.01) << "clamped";
  const double tip_curvature =
      (beam_mode(1.0) - 2.0 * beam_mode(1.0 - kStep) + beam_mode(1.0 - 2.0 * kStep)) / (kStep * kStep);
  EXPECT_NEAR(tip_curvature, 0.0, 0.02) << "free";
  EXPECT_NEAR(2.0 * std::numbers::pi / beam_frequency_radps(1.0, 1.0), 1.78702, 1e-5);
}

TEST(ExactSolutions, CatenariesHaveTheirLength) {
  // Sag over length of the reference solutions.
  for (const auto& [span, sag] :
       {std::pair{0.25, 0.463166}, {0.5, 0.398194}, {0.75, 0.294334}, {0.9, 0.190709}}) {
    EXPECT_NEAR(catenary_sag(span), sag, 1e-6) << span;
  }
  // A chain hung from one point is folded in two; a taut one does not sag: sag^2 = 3/8 d (L - d).
  EXPECT_NEAR(catenary_sag(1e-4), 0.5, 1e-3);
  EXPECT_NEAR(catenary_sag(0.9999), std::sqrt(3.0 / 8.0 * 1e-4), 1e-5);
}

TEST(ExactSolutions, TheTractrixPointsAtItsHead) {
  for (const double way : {0.1, 0.5, 1.0, 2.0, 3.0}) {
    const glm::dvec2 end = tractrix_end(way);
    const glm::dvec2 to_head = glm::dvec2(way, 0.0) - end;
    EXPECT_NEAR(glm::length(to_head), 1.0, 1e-12);
    // The end moves towards the head.
    constexpr double kStep = 1e-5;
    const glm::dvec2 moved = (tractrix_end(way + kStep) - tractrix_end(way - kStep)) / (2.0 * kStep);
    EXPECT_NEAR(moved.x * to_head.y - moved.y * to_head.x, 0.0, 1e-8) << way;
  }
  EXPECT_NEAR(tractrix_end(2.0).x, 1.035972, 1e-6);
  EXPECT_NEAR(tractrix_end(2.0).y, 0.265802, 1e-6);
}

TEST(ExactSolutions, UprightRodsBuckleAtTheRootOfTheBesselFunction) {
  // J_(-1/3) = cos(pi/3) J_(1/3) - sin(pi/3) Y_(1/3).
  const double root = std::sqrt(kBucklingGamma * 4.0 / 9.0);
  constexpr double kThird = 1.0 / 3.0;
  const double value = std::cos(std::numbers::pi * kThird) * std::cyl_bessel_j(kThird, root) -
                       std::sin(std::numbers::pi * kThird) * std::cyl_neumann(kThird, root);
  EXPECT_NEAR(value, 0.0, 1e-5);
}

TEST(ExactSolutions, StepRootsSolveTheirDifferenceEquations) {
  for (const double omega_h : {0.05, 0.3, 1.0}) {
    const std::complex<double> turn(0.0, omega_h);
    const std::complex<double> euler = implicit_step_root(1, omega_h);
    EXPECT_NEAR(std::abs(euler - 1.0 - turn * euler), 0.0, 1e-14);
    const std::complex<double> z = implicit_step_root(2, omega_h);
    EXPECT_NEAR(std::abs(1.5 * z * z - 2.0 * z + 0.5 - turn * z * z), 0.0, 1e-13);
    EXPECT_LT(damping_per_radian(z), 0.0);
    EXPECT_GT(damping_per_radian(z), damping_per_radian(euler)) << "the second order damps less";
  }
}

}  // namespace
}  // namespace strandcast::exact_solutions_test
