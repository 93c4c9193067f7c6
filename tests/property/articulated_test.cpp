// articulated against mechanics: the modes of the lumped chain, the heavy pendulum's energy, the shapes of a
// bent rod, the spring constant of a coil, and how errors fall with the step.
#include <algorithm>
#include <complex>
#include <numbers>

#include "server/report/swing_fit.h"
#include "tests/support/solver_fixture.h"

namespace strandcast::articulated_test {
namespace {

constexpr double kLengthM = 0.3;
constexpr double kGravityMps2 = 9.81;
// Backward Euler multiplies a mode by z = 1 / (1 - i omega h) per step, so omega follows from z whatever h.
constexpr double kModeSubstepS = 1.0 / 60.0;

/// One straight strand from the head joint, clamped at its first vertex.
Groom straight_strand(uint32_t vertex_count, const glm::dvec3& direction, double length_m = kLengthM) {
  std::vector<glm::vec3> strand;
  for (uint32_t i = 0; i < vertex_count; ++i)
    strand.emplace_back(direction * (length_m * i / (vertex_count - 1)));
  return groom_from({strand}, Pinning::Root);
}

class Articulated : public SolverTest {
 protected:
  static SolverParameters bare(SolverParameters more = {}) {
    more.insert({{"air_drag_per_s", 0.0}, {"style_stiffness_per_s2", 0.0}, {"bending_damping_s", 0.0}});
    return more;
  }
  std::unique_ptr<Solver> make_chain(const SolverHost& host, const Groom& groom,
                                     const SolverParameters& given) {
    return make({*find_solver("articulated"), host}, groom, given);
  }
  /// Angular frequency of the slowest mode after the faster ones have died away, rad/s.
  double slowest_mode_radps(const Groom& groom, const SolverParameters& given, const glm::dvec3& gravity) {
    constexpr int kFadingSteps = 450;
    constexpr int kFittedSteps = 100;
    auto chain = make_chain(kReferenceHost, groom, given);
    SolverState state = read(*chain);
    const size_t n = state.position_m.size();
    for (size_t i = 1; i < n; ++i) {
      const double s = static_cast<double>(i) / static_cast<double>(n - 1);
      state.position_m[i].y = static_cast<float>(1e-4 * kLengthM * s * s);
    }
    chain->write(state);
    StepInput input;
    input.h_s = kModeSubstepS;
    input.gravity_mps2 = gravity;
    std::vector<double> q;
    for (int step = 0; step < kFadingSteps + kFittedSteps; ++step) {
      chain->substep(input);
      if (step >= kFadingSteps) q.push_back(static_cast<double>(read(*chain).position_m.back().y));
    }
    return -std::imag(1.0 / swing_root(q)) / kModeSubstepS;
  }
};

// Point masses at the vertices, half of one at the tip: omega_1 / sqrt(g / L) from the eigenvalues of the
// lumped chain (limit 1.202413, half of the Bessel function's first root).
TEST_F(Articulated, WithoutStiffnessItSwingsAsTheLumpedChain) {
  const std::vector<std::pair<uint32_t, double>> chains = {
      {7, 1.195192}, {15, 1.200832}, {31, 1.202043}, {63, 1.202323}};
  for (const auto& [links, expected] : chains) {
    const double omega = slowest_mode_radps(straight_strand(links + 1, {0.0, 0.0, 1.0}),
                                            bare({{"young_modulus_pa", 0.0}}), {0.0, 0.0, kGravityMps2});
    const double ratio = omega / std::sqrt(kGravityMps2 / kLengthM) / expected;
    EXPECT_NEAR(ratio, 1.0, 5e-6) << links << " links";
    fmt::print("{} links: frequency off by {:+.1e}\n", links, ratio - 1.0);
  }
}

/// Young's modulus with which a hair of the default radius and density has EI / (rho A) = b.
double modulus_for(double b_m4ps2) {
  constexpr double kRadiusM = 5e-5;
  constexpr double kDensityKgpm3 = 1300.0;
  return b_m4ps2 * 4.0 * kDensityKgpm3 / (kRadiusM * kRadiusM);
}

// omega_1 = 3.516015 sqrt(b / L^4).
TEST_F(Articulated, WithoutGravityItSwingsAsTheClampedBeam) {
  constexpr double kOmegaRadps = 8.0;
  const double b = std::pow(kOmegaRadps / 3.516015, 2) * std::pow(kLengthM, 4);
  for (const uint32_t links : {15u, 31u, 63u}) {
    const double omega = slowest_mode_radps(straight_strand(links + 1, {1.0, 0.0, 0.0}),
                                            bare({{"young_modulus_pa", modulus_for(b)}}), glm::dvec3(0.0));
    // Clamped at the vertex, the error falls with the square of the number of links.
    EXPECT_NEAR(omega / kOmegaRadps, 1.0, 1.0 / (links * links)) << links << " links";
    fmt::print("{} links: beam frequency off by {:+.1e}\n", links, omega / kOmegaRadps - 1.0);
  }
}

struct CantileverShape {
  double gamma;
  double x;  // of the tip over the length
  double y;
};

// b theta'' = -g (L - s) cos(theta), theta(0) = 0, theta'(L) = 0, Gamma = g L^3 / b.
TEST_F(Articulated, ACantileverHangsAsTheExactCurve) {
  const std::vector<CantileverShape> shapes = {{1.0, 0.991246, 0.123471},   {5.0, 0.846657, 0.495905},
                                               {10.0, 0.656354, 0.700200},  {20.0, 0.445232, 0.829881},
                                               {200.0, 0.107420, 0.956769}, {1000.0, 0.045986, 0.981141}};
  constexpr double kRateHz = 60.0;
  constexpr double kSettlingS = 12.0;
  const Groom groom = straight_strand(32, {1.0, 0.0, 0.0});
  for (const SolverHost& host : solver_hosts()) {
    for (const CantileverShape& shape : shapes) {
      SCOPED_TRACE(fmt::format("{}, Gamma {}", host.name(), shape.gamma));
      const double b = kGravityMps2 * std::pow(kLengthM, 3) / shape.gamma;
      auto chain = make_chain(
          host, groom,
          {{"young_modulus_pa", modulus_for(b)}, {"air_drag_per_s", 20.0}, {"style_stiffness_per_s2", 0.0}});
      StepInput input;
      input.gravity_mps2 = {0.0, -kGravityMps2, 0.0};
      for (int step = 0; step < kSettlingS * kRateHz; ++step) chain->substep(input);
      const glm::dvec3 tip = glm::dvec3(read(*chain).position_m.back()) / kLengthM;
      const double off = std::hypot(tip.x - shape.x, tip.y + shape.y);
      EXPECT_LE(off, 0.0025);
      fmt::print("{}, Gamma {}: tip off by {:.3f} % of the length\n", host.name(), shape.gamma, 100.0 * off);
    }
  }
}

// A coil of N turns of radius R and small pitch is a spring of k = G r^4 / (4 N R^3), by twist almost alone;
// its own weight stretches it by m g / (2 k). Checks that twist is kept and that it has the right stiffness.
TEST_F(Articulated, ACoilStretchesAsAHelicalSpring) {
  constexpr double kTurns = 3.0;
  constexpr double kRadiusM = 5e-3;
  constexpr double kPitchM = 5e-4;
  constexpr uint32_t kVertexCount = 64;
  constexpr double kLoadMps2 = 0.2;
  const HairConstants hair;
  std::vector<glm::vec3> strand;
  for (uint32_t i = 0; i < kVertexCount; ++i) {
    const double angle = 2.0 * std::numbers::pi * kTurns * i / (kVertexCount - 1);
    strand.emplace_back(kRadiusM * std::cos(angle), -kPitchM * kTurns * i / (kVertexCount - 1),
                        kRadiusM * std::sin(angle));
  }
  const Groom groom = groom_from({strand}, Pinning::RootPair);
  const double wire_m = 2.0 * std::numbers::pi * kRadiusM * kTurns;
  const double spring_npm =
      hair.shear_modulus_pa() * std::pow(hair.radius_m, 4) / (4.0 * kTurns * std::pow(kRadiusM, 3));
  const double expected_m = hair.linear_density_kgpm() * wire_m * kLoadMps2 / (2.0 * spring_npm);
  for (const SolverHost& host : solver_hosts()) {
    auto chain = make_chain(host, groom, {{"air_drag_per_s", 20.0}, {"style_stiffness_per_s2", 0.0}});
    StepInput input;
    input.gravity_mps2 = {0.0, -kLoadMps2, 0.0};
    for (int step = 0; step < 600; ++step) chain->substep(input);
    const SolverState state = read(*chain);
    const double sunk_m = static_cast<double>(strand.back().y - state.position_m.back().y);
    EXPECT_NEAR(sunk_m / expected_m, 1.0, 0.03);
    fmt::print("{}: the coil sinks by {:.3e} m, a spring by {:.3e} m\n", host.name(), sunk_m, expected_m);
  }
}

/// Two links let go horizontally; how a step's length changes energy and path.
class DoublePendulum : public Articulated {
 protected:
  struct Fall {
    glm::dvec3 tip_m{0.0};
    double energy_share = 0.0;  // change of the total energy over what the fall could give
  };
  Fall fall(const SolverHost& host, double h_s) {
    constexpr double kTimeS = 0.25;
    auto chain = make_chain(host, straight_strand(3, {1.0, 0.0, 0.0}),
                            bare({{"young_modulus_pa", 0.0}, {"max_speed_mps", 1000.0}}));
    StepInput input;
    input.h_s = h_s;
    input.gravity_mps2 = {0.0, -kGravityMps2, 0.0};
    const int steps = static_cast<int>(std::lround(kTimeS / h_s));
    for (int step = 0; step < steps; ++step) chain->substep(input);
    const SolverState state = read(*chain);
    double energy = 0.0;
    for (size_t i = 1; i < 3; ++i) {
      const double mass = i == 1 ? 1.0 : 0.5;
      const glm::dvec3 velocity(state.velocity_mps[i]);
      energy += mass * (0.5 * glm::dot(velocity, velocity) +
                        kGravityMps2 * static_cast<double>(state.position_m[i].y));
    }
    return {glm::dvec3(state.position_m[2]), energy / (kGravityMps2 * kLengthM)};
  }
};

TEST_F(DoublePendulum, EnergyOnlyFallsAndTheLossHalvesWithTheStep) {
  const double coarse = fall(kReferenceHost, 1.0 / 480.0).energy_share;
  const double middle = fall(kReferenceHost, 1.0 / 960.0).energy_share;
  const double fine = fall(kReferenceHost, 1.0 / 1920.0).energy_share;
  EXPECT_LT(coarse, 0.0);
  EXPECT_GT(coarse, -0.1);
  EXPECT_NEAR(coarse / middle, 2.0, 0.3);
  EXPECT_NEAR(middle / fine, 2.0, 0.15);
  fmt::print("energy lost: {:.2e}, {:.2e}, {:.2e} of the fall's\n", coarse, middle, fine);
}

TEST_F(DoublePendulum, ThePathIsOfFirstOrder) {
  const glm::dvec3 expected =
      2.0 * fall(kReferenceHost, 1.0 / 61440.0).tip_m - fall(kReferenceHost, 1.0 / 30720.0).tip_m;
  const double coarse_m = glm::distance(fall(kReferenceHost, 1.0 / 480.0).tip_m, expected);
  const double middle_m = glm::distance(fall(kReferenceHost, 1.0 / 960.0).tip_m, expected);
  const double fine_m = glm::distance(fall(kReferenceHost, 1.0 / 1920.0).tip_m, expected);
  EXPECT_NEAR(coarse_m / middle_m, 2.0, 0.3);
  EXPECT_NEAR(middle_m / fine_m, 2.0, 0.15);
  for (const SolverHost& host : kernel_hosts())
    EXPECT_LE(glm::distance(fall(host, 1.0 / 480.0).tip_m, fall(kReferenceHost, 1.0 / 480.0).tip_m), 1e-5)
        << host.name();
  fmt::print("tip off by {:.2e}, {:.2e}, {:.2e} m\n", coarse_m, middle_m, fine_m);
}

// Nothing pulls on a strand whose head falls with it.
TEST_F(Articulated, AFallingHeadKeepsTheShape) {
  const Groom groom = make_test_groom({});
  for (const SolverHost& host : solver_hosts()) {
    auto chain = make_chain(host, groom, bare());
    const SolverState before = read(*chain);
    StepInput input;
    double speed_mps = 0.0;
    for (int step = 1; step <= 60; ++step) {
      speed_mps += input.h_s * input.gravity_mps2.y;
      input.head_shift_m = {0.0, input.h_s * speed_mps, 0.0};
      chain->substep(input);
    }
    EXPECT_LE(largest_distance_m(read(*chain).position_m, before.position_m), host.is_kernel() ? 1e-4 : 1e-6);
  }
}

TEST_F(Articulated, AMillionTimesStifferKeepsTheGroom) {
  const Groom groom = make_test_groom({});
  for (const SolverHost& host : solver_hosts()) {
    for (const double factor : {1e2, 1e4, 1e6}) {
      SCOPED_TRACE(fmt::format("{}, stiffness x {}", host.name(), factor));
      auto chain =
          make_chain(host, groom, {{"young_modulus_pa", factor * 3e9}, {"style_stiffness_per_s2", 0.0}});
      double off_m = 0.0;
      for (int step = 1; step <= 240; ++step) {
        StepInput input = moving_input(step, 1.0 / 60.0);
        input.colliders.clear();
        chain->substep(input);
        const SolverState state = read(*chain);
        ASSERT_TRUE(is_finite(state)) << "step " << step;
        ASSERT_LE(length_excess_m(groom, state, 1e-5), 0.0) << "step " << step;
        for (uint32_t s = 0; s < groom.strand_count(); ++s) {
          const glm::vec3 tip = groom.rest_position_m[groom.offset[s + 1] - 1];
          const glm::dvec3 groomed = input.world_from_head_rotation * glm::dvec3(tip);
          const size_t at = (groom.vertex_count(s) - 1) * groom.strand_count() + s;
          off_m = std::max(off_m, glm::distance(groomed, glm::dvec3(state.position_m[at])));
        }
      }
      if (factor >= 1e6) {
        EXPECT_LE(off_m, 1e-3);
      }
      fmt::print("{}, stiffness x {}: tips off the groom by {:.1e} m at most\n", host.name(), factor, off_m);
    }
  }
}

}  // namespace
}  // namespace strandcast::articulated_test
