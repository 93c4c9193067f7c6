// angular_projection: hangs as a rod does, approaches the articulated chain with more sweeps, gains no
// energy, and knows no pole.
#include <algorithm>

#include "tests/support/solver_fixture.h"

namespace strandcast::angular_projection_test {
namespace {

constexpr double kLengthM = 0.3;
constexpr double kGravityMps2 = 9.81;

Groom straight_strand(uint32_t vertex_count, const glm::dvec3& direction) {
  std::vector<glm::vec3> strand;
  for (uint32_t i = 0; i < vertex_count; ++i)
    strand.emplace_back(direction * (kLengthM * i / (vertex_count - 1)));
  return groom_from({strand}, Pinning::Root);
}

class AngularProjection : public SolverTest {
 protected:
  static SolverParameters bare(SolverParameters more = {}) {
    more.insert({{"air_drag_per_s", 0.0}, {"style_stiffness_per_s2", 0.0}, {"bending_damping_s", 0.0}});
    return more;
  }
  std::unique_ptr<Solver> make_strand(const SolverHost& host, const Groom& groom,
                                      const SolverParameters& given) {
    return make({*find_solver("angular_projection"), host}, groom, given);
  }
};

/// Young's modulus with which a hair of the default radius and density has EI / (rho A) = b.
double modulus_for(double b_m4ps2) {
  constexpr double kRadiusM = 5e-5;
  constexpr double kDensityKgpm3 = 1300.0;
  return b_m4ps2 * 4.0 * kDensityKgpm3 / (kRadiusM * kRadiusM);
}

struct CantileverShape {
  double gamma;
  double x;  // of the tip over the length
  double y;
};

// b theta'' = -g (L - s) cos(theta), theta(0) = 0, theta'(L) = 0, Gamma = g L^3 / b: whatever the sweeps
// leave undone, where nothing moves any more the moments are in balance.
TEST_F(AngularProjection, ACantileverHangsAsTheExactCurve) {
  const std::vector<CantileverShape> shapes = {{1.0, 0.991246, 0.123471},
                                               {10.0, 0.656354, 0.700200},
                                               {20.0, 0.445232, 0.829881},
                                               {200.0, 0.107420, 0.956769}};
  constexpr double kRateHz = 60.0;
  constexpr double kSettlingS = 20.0;
  const Groom groom = straight_strand(32, {1.0, 0.0, 0.0});
  for (const SolverHost& host : kernel_hosts())
    for (const CantileverShape& shape : shapes) {
      SCOPED_TRACE(fmt::format("{}, Gamma {}", host.name(), shape.gamma));
      // OpenGL takes ten times as long on processors: the softest and the stiffest of them.
      if (host.device == SimDevice::Gl && shape.gamma != shapes.front().gamma &&
          shape.gamma != shapes.back().gamma)
        continue;
      const double b = kGravityMps2 * std::pow(kLengthM, 3) / shape.gamma;
      auto solver = make_strand(
          host, groom,
          {{"young_modulus_pa", modulus_for(b)}, {"air_drag_per_s", 20.0}, {"style_stiffness_per_s2", 0.0}});
      StepInput input;
      input.gravity_mps2 = {0.0, -kGravityMps2, 0.0};
      for (int step = 0; step < kSettlingS * kRateHz; ++step) solver->substep(input);
      const glm::dvec3 tip = glm::dvec3(read(*solver).position_m.back()) / kLengthM;
      const double off = std::hypot(tip.x - shape.x, tip.y + shape.y);
      EXPECT_LE(off, 0.0025);
      fmt::print("Gamma {}: tip off by {:.3f} % of the length\n", shape.gamma, 100.0 * off);
    }
}

// Both take the same step of backward Euler, one exactly, one by sweeps.
TEST_F(AngularProjection, MoreSweepsApproachTheArticulatedChain) {
  const Groom groom = straight_strand(16, {1.0, 0.0, 0.0});
  for (const SolverHost& host : kernel_hosts()) {
    SCOPED_TRACE(host.name());
    const auto tip_after = [&](const char* name, const SolverParameters& given) {
      auto solver = make({*find_solver(name), host}, groom, given);
      const StepInput input;
      for (int step = 0; step < 15; ++step) solver->substep(input);
      return glm::dvec3(read(*solver).position_m.back());
    };
    // Twist plays no part in a plane.
    const glm::dvec3 expected = tip_after("articulated", bare({{"solves", 4.0}}));
    double before_m = kLengthM;
    for (const double sweeps : {1.0, 4.0, 16.0, 64.0}) {
      const double off_m =
          glm::distance(tip_after("angular_projection", bare({{"sweeps", sweeps}})), expected);
      EXPECT_LT(off_m, 0.8 * before_m) << sweeps << " sweeps";
      before_m = off_m;
      fmt::print("{} sweeps: tip {:.1e} m off the chain's after a quarter of a second\n", sweeps, off_m);
    }
    EXPECT_LE(before_m, 2e-3);
  }
}

// A strand let go horizontally never lifts its centre above where it began.
TEST_F(AngularProjection, AnUndampedSwingGainsNoEnergy) {
  for (const SolverHost& host : kernel_hosts())
    for (const uint32_t vertex_count : {8u, 16u, 32u, 64u}) {
      for (const double rate_hz : {30.0, 60.0, 240.0}) {
        if (host.device == SimDevice::Gl && rate_hz > 60.0 && vertex_count > 8) continue;  // long there
        auto solver = make_strand(host, straight_strand(vertex_count, {1.0, 0.0, 0.0}), bare());
        StepInput input;
        input.h_s = 1.0 / rate_hz;
        double highest_m = -kLengthM;
        for (int step = 0; step < 6.0 * rate_hz; ++step) {
          solver->substep(input);
          const SolverState state = read(*solver);
          double height_m = 0.0;
          for (const glm::vec3& point : state.position_m) height_m += static_cast<double>(point.y);
          highest_m = std::max(highest_m, height_m / vertex_count);
        }
        EXPECT_LE(highest_m, 0.0) << host.name() << ", " << vertex_count << " vertices, " << rate_hz << " Hz";
      }
    }
}

// Polar angles have a pole where the azimuth is undefined. Strands along any axis, pushed across it, move as
// the one along x does.
TEST_F(AngularProjection, NoDirectionIsSpecial) {
  const std::vector<glm::dquat> turns = {{1.0, 0.0, 0.0, 0.0},
                                         glm::angleAxis(glm::radians(90.0), glm::dvec3(0.0, 0.0, 1.0)),
                                         glm::angleAxis(glm::radians(180.0), glm::dvec3(0.0, 0.0, 1.0)),
                                         glm::angleAxis(glm::radians(-90.0), glm::dvec3(0.0, 0.0, 1.0)),
                                         glm::angleAxis(glm::radians(90.0), glm::dvec3(0.0, 1.0, 0.0))};
  for (const SolverHost& host : solver_hosts()) {
    glm::dvec3 expected(0.0);
    for (const glm::dquat& turn : turns) {
      auto solver = make_strand(host, straight_strand(16, turn * glm::dvec3(1.0, 0.0, 0.0)), {});
      StepInput input;
      input.gravity_mps2 = turn * glm::dvec3(-2.0, 6.0, -4.0);
      for (int step = 0; step < 30; ++step) solver->substep(input);
      const glm::dvec3 tip = glm::conjugate(turn) * glm::dvec3(read(*solver).position_m.back());
      if (turn == turns.front()) expected = tip;
      EXPECT_LE(glm::distance(tip, expected), host.is_kernel() ? 1e-5 : 1e-7);
    }
    EXPECT_GE(glm::distance(expected, glm::dvec3(kLengthM, 0.0, 0.0)), 0.01);
  }
}

TEST_F(AngularProjection, AMillionTimesStifferStaysFinite) {
  const Groom groom = make_test_groom({});
  for (const SolverHost& host : solver_hosts()) {
    for (const double factor : {1e2, 1e4, 1e6}) {
      SCOPED_TRACE(fmt::format("{}, stiffness x {}", host.name(), factor));
      auto solver = make_strand(host, groom, {{"young_modulus_pa", factor * 3e9}});
      for (int step = 1; step <= 240; ++step) {
        solver->substep(moving_input(step, 1.0 / 60.0));
        const SolverState state = read(*solver);
        ASSERT_TRUE(is_finite(state)) << "step " << step;
        ASSERT_LE(length_excess_m(groom, state, 1e-5), 0.0) << "step " << step;
      }
    }
  }
}

}  // namespace
}  // namespace strandcast::angular_projection_test
