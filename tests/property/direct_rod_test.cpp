// direct_rod against the mechanics of rods: shapes and periods known in closed form or from boundary-value
// solutions to 1e-10, the damping that the integrator's characteristic polynomial predicts, and lengths.
#include <algorithm>
#include <complex>

#include "server/report/swing_fit.h"
#include "server/sim/hair_constants.h"
#include "tests/property/direct_rod_fixture.h"
#include "tests/support/claims.h"

namespace strandcast::direct_rod_test {
namespace {

class RodMechanics : public DirectRod {
 protected:
  /// The tip of a horizontal strand, b = g L^3 / gamma, after it came to rest.
  glm::dvec3 settled_tip(const SolverHost& host, uint32_t vertex_count, double gamma, double rate_hz) {
    const double b = kGravityMps2 * kLengthM * kLengthM * kLengthM / gamma;
    auto rod = make_rod(host, straight_strand(vertex_count, {1.0, 0.0, 0.0}),
                        {{"young_modulus_pa", modulus_for(b)}, {"air_drag_per_s", 20.0}});
    StepInput input;
    input.h_s = 1.0 / rate_hz;
    input.gravity_mps2 = {0.0, -kGravityMps2, 0.0};
    constexpr double kSettlingS = 12.0;
    for (int step = 0; step < kSettlingS * rate_hz; ++step) rod->substep(input);
    return glm::dvec3(read(*rod).position_m.back());
  }
};

struct CantileverShape {
  double gamma;
  double x;  // of the tip over the length
  double y;
};

// Large deflection of a cantilever under its weight: b theta'' = -g (L - s) cos(theta), theta(0) = 0,
// theta'(L) = 0, Gamma = g L^3 / b.
const std::vector<CantileverShape>& cantilever_shapes() {
  static const std::vector<CantileverShape> shapes = {
      {1.0, 0.991246, 0.123471},   {2.0, 0.966893, 0.238507},    {5.0, 0.846657, 0.495905},
      {10.0, 0.656354, 0.700200},  {20.0, 0.445232, 0.829881},   {50.0, 0.245015, 0.907917},
      {200.0, 0.107420, 0.956769}, {1000.0, 0.045986, 0.981141}, {500.0, 0.065890, 0.973117}};
  return shapes;
}

TEST_F(RodMechanics, ACantileverHangsAsTheExactCurve) {
  for (const SolverHost& host : solver_hosts()) {
    for (const CantileverShape& shape : cantilever_shapes()) {
      SCOPED_TRACE(fmt::format("{}, Gamma {}", host.name(), shape.gamma));
      const glm::dvec3 tip = settled_tip(host, claims::kRodVertices, shape.gamma, 60.0) / kLengthM;
      const double height_over_width = -tip.y / tip.x / (shape.y / shape.x) - 1.0;
      const double off = std::hypot(tip.x - shape.x, tip.y + shape.y);
      if (shape.gamma <= 20.0) {
        EXPECT_LE(std::abs(height_over_width), 0.002);
      }
      if (shape.gamma <= claims::kCantileverGamma) {
        EXPECT_LE(off, claims::kCantileverTip);
      } else {
        ASSERT_LE(shape.gamma, claims::kHeavyCantileverGamma);
        EXPECT_LE(off, claims::kHeavyCantileverTip);
      }
      fmt::print("{}, Gamma {}: H/W {:+.3f} %, tip off by {:.3f} % of the length\n", host.name(), shape.gamma,
                 100.0 * height_over_width, 100.0 * off);
    }
  }
}

TEST_F(RodMechanics, DroopDependsOnNeitherVerticesNorRate) {
  for (const double gamma : {10.0, 184.0}) {
    double least = 1.0;
    double most = 0.0;
    for (const uint32_t vertex_count : {8u, 16u, 32u, 64u}) {
      for (const double rate_hz : {30.0, 60.0, 120.0, 240.0}) {
        const double droop = -settled_tip(kReferenceHost, vertex_count, gamma, rate_hz).y / kLengthM;
        least = std::min(least, droop);
        most = std::max(most, droop);
      }
    }
    EXPECT_LE(most / least - 1.0, 0.012) << "Gamma " << gamma;
    fmt::print("Gamma {}: droop {:.5f} to {:.5f} of the length, spread {:.3f} %\n", gamma, least, most,
               100.0 * (most / least - 1.0));
  }
}

/// First bending mode of a clamped free beam at s in 0..1.
double beam_mode(double s) {
  constexpr double kBeta = 1.8751040687;  // root of cos cosh = -1
  constexpr double kSigma = 0.7340955138;
  const double x = kBeta * s;
  return std::cosh(x) - std::cos(x) - kSigma * (std::sinh(x) - std::sin(x));
}

constexpr double kBeamBetaSquared = 3.516015;

/// Displacements along y, weighted with a mode.
double project(const SolverState& state, const std::function<double(double)>& mode) {
  const size_t n = state.position_m.size();
  double sum = 0.0;
  for (size_t i = 0; i < n; ++i) {
    const double weight = i + 1 < n ? 1.0 : 0.5;
    sum += weight * mode(static_cast<double>(i) / static_cast<double>(n - 1)) *
           static_cast<double>(state.position_m[i].y);
  }
  return sum;
}

TEST_F(RodMechanics, ACantileverLetGoSwingsAsTheBeam) {
  // A small load put on at once: the tip's first maximum is 2.0253 times the static one, from the first
  // modes' shares 1.01339, -0.01430, 0.00107 and their frequencies.
  constexpr double kRateHz = claims::kFirstSwingHz;
  constexpr double kPeriodS = 1.787018;
  constexpr double kLoadMps2 = 0.01;
  const double b = std::pow(2.0 * std::numbers::pi / kPeriodS / kBeamBetaSquared, 2) * std::pow(kLengthM, 4);
  const double static_m = kLoadMps2 * std::pow(kLengthM, 4) / (8.0 * b);
  StepInput input;
  input.h_s = 1.0 / kRateHz;
  input.gravity_mps2 = {0.0, -kLoadMps2, 0.0};
  const double middle = [&] {
    // The static curve's share of the mode: the same sum over y = (s^2 (6 - 4 s + s^2) / 3) times the tip's.
    double sum = 0.0;
    for (int i = 0; i < 32; ++i) {
      const double s = i / 31.0;
      sum -= (i < 31 ? 1.0 : 0.5) * beam_mode(s) * static_m * s * s * (6.0 - 4.0 * s + s * s) / 3.0;
    }
    return sum;
  }();
  for (const SolverHost& host : solver_hosts()) {
    SCOPED_TRACE(host.name());
    auto rod =
        make_rod(host, straight_strand(32, {1.0, 0.0, 0.0}),
                 {{"young_modulus_pa", modulus_for(b)}, {"air_drag_per_s", 0.0}, {"bending_damping_s", 0.0}});
    double largest = 0.0;
    double before = 0.0;
    std::vector<double> crossings_s;
    for (int step = 1; step <= 4.2 * kPeriodS * kRateHz; ++step) {
      rod->substep(input);
      const SolverState state = read(*rod);
      if (step < 0.7 * kPeriodS * kRateHz)
        largest = std::max(largest, -static_cast<double>(state.position_m.back().y) / static_m);
      const double now = project(state, beam_mode) - middle;
      if (step > 1 && before > 0.0 && now <= 0.0)
        crossings_s.push_back((step - 1 + before / (before - now)) * input.h_s);
      before = now;
    }
    ASSERT_GE(crossings_s.size(), 3u);
    const double period_s =
        (crossings_s.back() - crossings_s.front()) / static_cast<double>(crossings_s.size() - 1);
    EXPECT_NEAR(largest / 2.0253, 1.0, claims::kFirstSwing);
    EXPECT_NEAR(period_s / kPeriodS, 1.0, 0.002);
    fmt::print("{}: first swing {:.4f} of the static deflection (2.0253), period {:+.3f} %\n", host.name(),
               largest, 100.0 * (period_s / kPeriodS - 1.0));
  }
}

// Damping is what the integrator predicts for x'' = -omega^2 x. Backward Euler multiplies by 1 / (1 - i omega
// h). Order 2 has 3/2 z^2 - 2 z + 1/2 = i omega h z^2, that is z = (2 + sqrt(1 + 2 i omega h)) / (3 - 2 i
// omega h).
TEST_F(RodMechanics, DampingIsWhatTheIntegratorPredicts) {
  constexpr double kRateHz = 60.0;
  for (const int order : {1, 2}) {
    for (const double omega_h : {0.15, 0.3, 0.5}) {
      SCOPED_TRACE(fmt::format("order {}, omega h {}", order, omega_h));
      const double omega = omega_h * kRateHz;
      const double b = std::pow(omega / kBeamBetaSquared, 2) * std::pow(kLengthM, 4);
      auto rod = make_rod(kReferenceHost, straight_strand(32, {1.0, 0.0, 0.0}),
                          {{"young_modulus_pa", modulus_for(b)},
                           {"air_drag_per_s", 0.0},
                           {"bending_damping_s", 0.0},
                           {"order", order}});
      SolverState state = read(*rod);
      for (size_t i = 1; i < state.position_m.size(); ++i)
        state.position_m[i].y =
            static_cast<float>(1e-4 * kLengthM * beam_mode(static_cast<double>(i) / 31.0));
      rod->write(state);
      std::vector<double> q;
      const StepInput input = calm_input(1.0 / kRateHz);
      for (int step = 0; step < 80; ++step) {
        rod->substep(input);
        if (step >= 20) q.push_back(project(read(*rod), beam_mode));
      }
      const std::complex<double> turn(0.0, omega_h);
      const std::complex<double> predicted =
          order == 1 ? 1.0 / (1.0 - turn) : (2.0 + std::sqrt(1.0 + 2.0 * turn)) / (3.0 - 2.0 * turn);
      const std::complex<double> measured = swing_root(q);
      const auto per_period = [](const std::complex<double>& z) {
        return std::log(std::abs(z)) / std::arg(z);
      };
      EXPECT_NEAR(per_period(measured) / per_period(predicted), 1.0, 0.02);
      EXPECT_NEAR(std::arg(measured) / std::arg(predicted), 1.0, 0.01);
      fmt::print(
          "order {}, omega h {}: amplitude per period {:.4f} (predicted {:.4f}), damping ratio {:.4f}\n",
          order, omega_h, std::exp(2.0 * std::numbers::pi * per_period(measured)),
          std::exp(2.0 * std::numbers::pi * per_period(predicted)),
          per_period(measured) / per_period(predicted));
    }
  }
}

TEST_F(RodMechanics, WithoutStiffnessItIsAHeavyChain) {
  // omega_1 = j / 2 sqrt(g / L), j the first root of the Bessel function J0; the mode is J0(j sqrt(1 - s)).
  constexpr double kRoot = 2.404825557695773;
  constexpr double kRateHz = 240.0;
  const auto mode = [](double s) { return std::cyl_bessel_j(0.0, kRoot * std::sqrt(1.0 - s)); };
  const double period_s = 4.0 * std::numbers::pi / kRoot * std::sqrt(kLengthM / kGravityMps2);
  auto rod = make_rod(kReferenceHost, straight_strand(32, {0.0, 0.0, 1.0}),
                      {{"young_modulus_pa", 0.0}, {"air_drag_per_s", 0.0}, {"bending_damping_s", 0.0}});
  SolverState state = read(*rod);
  for (size_t i = 1; i < state.position_m.size(); ++i)
    state.position_m[i].y = static_cast<float>(1e-3 * kLengthM * mode(static_cast<double>(i) / 31.0));
  rod->write(state);
  StepInput input;
  input.h_s = 1.0 / kRateHz;
  input.gravity_mps2 = {0.0, 0.0, kGravityMps2};
  std::vector<double> crossings_s;
  double before = 1.0;
  for (int step = 1; step <= 5.0 * period_s * kRateHz; ++step) {
    rod->substep(input);
    const double now = project(read(*rod), mode);
    if (before > 0.0 && now <= 0.0) crossings_s.push_back((step - 1 + before / (before - now)) * input.h_s);
    before = now;
  }
  ASSERT_GE(crossings_s.size(), 4u);
  const double measured_s =
      (crossings_s.back() - crossings_s.front()) / static_cast<double>(crossings_s.size() - 1);
  EXPECT_NEAR(measured_s / period_s, 1.0, 0.001);
  fmt::print("heavy chain: period {:+.3f} %\n", 100.0 * (measured_s / period_s - 1.0));
}

// Undamped hair of 30 cm, let go horizontally, and shaken from side to side at 3 Hz.
TEST_F(RodMechanics, StretchStaysBelowAHundredthOfAPercentAtEveryMoment) {
  constexpr double kSubstepS = 1.0 / 60.0;
  constexpr double kShakeRadps = 2.0 * std::numbers::pi * 3.0;
  constexpr double kShakeM = claims::kShakeG * kGravityMps2 / (kShakeRadps * kShakeRadps);
  for (const SolverHost& host : solver_hosts()) {
    double worst = 0.0;
    for (const uint32_t vertex_count : {16u, 32u, 48u, 64u}) {
      for (const bool is_shaken : {false, true}) {
        auto rod = make_rod(host, straight_strand(vertex_count, {1.0, 0.0, 0.0}),
                            {{"air_drag_per_s", 0.0}, {"bending_damping_s", 0.0}});
        const double segment_m = kLengthM / (vertex_count - 1);
        for (int step = 1; step <= 180; ++step) {
          StepInput input;
          const double t = step * kSubstepS;
          const double way_m =
              kShakeM * (std::sin(kShakeRadps * t) - std::sin(kShakeRadps * (t - kSubstepS)));
          if (is_shaken) input.head_shift_m = {way_m, 0.0, 0.0};
          rod->substep(input);
          const SolverState state = read(*rod);
          for (size_t i = 1; i < vertex_count; ++i) {
            const double length_m =
                glm::distance(glm::dvec3(state.position_m[i]), glm::dvec3(state.position_m[i - 1]));
            worst = std::max(worst, std::abs(length_m / segment_m - 1.0));
          }
        }
      }
    }
    EXPECT_LE(worst, claims::kShakeStretch);
    fmt::print("{}: largest stretch {:.1e}\n", host.name(), worst);
  }
}

// As it ships hair moves in the air as a wisp does, not as single hairs: in a light breeze it leans, and does
// not fly.
TEST_F(RodMechanics, HairLeansInABreezeAsAWispDoes) {
  constexpr double kBreezeMps = 1.5, kAirKgpm3 = 1.2, kWispM = 0.005, kHairShare = 0.1, kCylinderDrag = 1.0;
  const double wisp_per_s = 2.0 * kCylinderDrag * kAirKgpm3 * kBreezeMps /
                            (std::numbers::pi * kHairShare * HairConstants{}.density_kgpm3 * kWispM);
  const double drag_per_s = complete_parameters(**find_solver("direct_rod"), {})->at("air_drag_per_s");
  EXPECT_NEAR(drag_per_s, wisp_per_s, 0.3);
  const double lean_rad = std::atan(drag_per_s * kBreezeMps / kGravityMps2);  // of a chain, at rest
  for (const SolverHost& host : solver_hosts()) {
    auto rod = make_rod(host, straight_strand(32, {0.0, -1.0, 0.0}), {});
    StepInput input;
    input.wind_mps = {kBreezeMps, 0.0, 0.0};
    for (int step = 0; step < 900; ++step) rod->substep(input);
    const SolverState state = read(*rod);
    const glm::dvec3 way = glm::dvec3(state.position_m.back()) - glm::dvec3(state.position_m.front());
    const double leaned_rad = std::atan2(way.x, -way.y);
    EXPECT_LT(leaned_rad, lean_rad);
    EXPECT_GT(leaned_rad, 0.8 * lean_rad) << "but for the clamp";
    EXPECT_LT(leaned_rad, 20.0 * std::numbers::pi / 180.0);
  }
}

/// A hanging strand on a head that sways smoothly from rest; substeps repeat the pattern.
class SwayingRod : public DirectRod {
 protected:
  glm::dvec3 tip_after(const std::vector<double>& pattern_s) {
    constexpr double kTimeS = 0.8;
    constexpr double kSwayM = 0.1;
    const auto head_x = [](double t) { return kSwayM * std::pow(std::sin(std::numbers::pi * t / 1.6), 4); };
    auto rod = make_rod(kReferenceHost, straight_strand(16, {0.0, -1.0, 0.0}), {{"air_drag_per_s", 1.0}});
    double t = 0.0;
    for (size_t step = 0; t < kTimeS - 1e-9; ++step) {
      StepInput input;
      input.h_s = std::min(pattern_s[step % pattern_s.size()], kTimeS - t);
      input.head_shift_m = {head_x(t + input.h_s) - head_x(t), 0.0, 0.0};
      rod->substep(input);
      t += input.h_s;
    }
    return glm::dvec3(read(*rod).position_m.back());
  }
};

TEST_F(SwayingRod, TimeIntegrationIsOfSecondOrder) {
  const glm::dvec3 expected = tip_after({1.0 / 3840.0});
  const double coarse_m = glm::distance(tip_after({1.0 / 60.0}), expected);
  const double middle_m = glm::distance(tip_after({1.0 / 120.0}), expected);
  const double fine_m = glm::distance(tip_after({1.0 / 240.0}), expected);
  // Second order: four times as exact with half the step.
  EXPECT_GE(coarse_m / middle_m, 3.0);
  EXPECT_GE(middle_m / fine_m, 3.0);
  fmt::print("tip error {:.2e} m at 60 Hz, {:.2e} at 120, {:.2e} at 240\n", coarse_m, middle_m, fine_m);
}

TEST_F(SwayingRod, StepsOfChangingLengthAreAsExactAsEvenOnes) {
  const glm::dvec3 expected = tip_after({1.0 / 3840.0});
  const double even_m = glm::distance(tip_after({1.0 / 60.0}), expected);
  // None longer than the even ones; the last change is beyond the ratio that order 2 bears.
  const double uneven_m =
      glm::distance(tip_after({1.0 / 60.0, 1.0 / 120.0, 1.0 / 80.0, 1.0 / 300.0}), expected);
  EXPECT_LE(uneven_m, 2.0 * even_m);
  fmt::print("tip error {:.2e} m with even steps, {:.2e} with uneven ones\n", even_m, uneven_m);
}

TEST_F(RodMechanics, ASagFreeGroomStaysAsItWasLoaded) {
  // Short enough to be stable: longer ones buckle to the side, whatever their rest shape.
  std::vector<std::vector<glm::vec3>> strands;
  for (int s = 0; s < 5; ++s) {
    const glm::dvec3 out(std::cos(1.2 * s), 0.0, std::sin(1.2 * s));
    std::vector<glm::vec3> strand;
    glm::dvec3 point = 0.1 * out;
    for (int i = 0; i < 16; ++i) {
      strand.emplace_back(point);
      const double angle = 0.4 - 0.1 * i;
      point += 0.007 * (std::cos(angle) * out + std::sin(angle) * glm::dvec3(0.0, 1.0, 0.0));
    }
    strands.push_back(strand);
  }
  for (const Pinning pinning : {Pinning::Root, Pinning::RootPair}) {
    const Groom groom = groom_from(strands, pinning);
    for (const SolverHost& host : solver_hosts()) {
      double moved_m[2] = {0.0, 0.0};
      for (const int is_sag_free : {0, 1}) {
        auto rod = make_rod(host, groom, {{"sag_free", is_sag_free}});
        const SolverState before = read(*rod);
        StepInput input;
        input.groom_gravity_in_head_mps2 = input.gravity_mps2;
        for (int step = 0; step < 600; ++step) rod->substep(input);
        moved_m[is_sag_free] = largest_distance_m(read(*rod).position_m, before.position_m);
      }
      EXPECT_GE(moved_m[0], 0.01);
      EXPECT_LE(moved_m[1], host.is_kernel() ? 1e-4 : 1e-6);
      fmt::print("{}: sag {:.4f} m, sag-free {:.1e} m\n", host.name(), moved_m[0], moved_m[1]);
    }
  }
}

TEST_F(RodMechanics, AMillionTimesStifferStaysFinite) {
  const Groom groom = make_test_groom({});
  for (const SolverHost& host : solver_hosts()) {
    for (const double factor : {1e2, 1e4, 1e6}) {
      SCOPED_TRACE(fmt::format("{}, stiffness x {}", host.name(), factor));
      auto rod = make_rod(host, groom, {{"young_modulus_pa", factor * kHairModulusPa}});
      for (int step = 1; step <= 240; ++step) {
        rod->substep(moving_input(step, 1.0 / 60.0));
        const SolverState state = read(*rod);
        ASSERT_TRUE(is_finite(state)) << "step " << step;
        ASSERT_LE(length_excess_m(groom, state, 1e-5), 0.0) << "step " << step;
      }
    }
  }
}

}  // namespace
}  // namespace strandcast::direct_rod_test
