// Position-based models: one iteration by hand, Hooke's law for the compliant form, and how the stretch that
// is left falls with iterations and substeps.
#include "tests/support/solver_fixture.h"

namespace strandcast::position_laws_test {
namespace {

class PositionLaws : public SolverTest {
 protected:
  double stretch_under_motion(const SolverKind& kind, double iterations, int substeps) {
    const Groom groom = make_test_groom({});
    auto solver = make(kind, groom, {{"iterations", iterations}});
    double largest = 0.0;
    for (int step = 1; step <= 120 * substeps; ++step) {
      solver->substep(moving_input(step, 1.0 / 60.0 / substeps));
      largest = std::fmax(largest, largest_stretch(groom, read(*solver)));
    }
    return largest;
  }
};

TEST_F(PositionLaws, OneIterationMatchesTheEquationByHand) {
  // Let go horizontally, 1 m apart, h = 0.1 s, g = 10 m/s^2: predictions are 0.1 m lower. Then vertex 1 goes
  // to 1 m from the root; then both free ones to 1 m from each other, the tip of half the mass by twice as
  // much.
  const Groom groom = groom_from({{{0.f, 0.f, 0.f}, {1.f, 0.f, 0.f}, {2.f, 0.f, 0.f}}}, Pinning::Root);
  const glm::dvec3 q1 = glm::normalize(glm::dvec3(1.0, -0.1, 0.0));
  const glm::dvec3 p2(2.0, -0.1, 0.0);
  const double error_m = glm::distance(p2, q1) - 1.0;
  const glm::dvec3 along = glm::normalize(p2 - q1);
  const glm::dvec3 x1 = q1 + error_m / 3.0 * along;
  const glm::dvec3 x2 = p2 - 2.0 * error_m / 3.0 * along;
  for (const char* name : {"pbd", "xpbd"}) {
    for (const SolverHost& host : solver_hosts()) {
      auto solver = make({*find_solver(name), host}, groom,
                         {{"iterations", 1.0},
                          {"air_drag_per_s", 0.0},
                          {"style_stiffness_per_s2", 0.0},
                          {"max_speed_mps", 1000.0},
                          {"bend_stiffness", 0.0},
                          {"stretch_compliance_m_per_n", 0.0},
                          {"bend_compliance_m_per_n", 1e9},
                          {"linear_density_kg_per_m", 1.0}});
      StepInput input;
      input.h_s = 0.1;
      input.gravity_mps2 = {0.0, -10.0, 0.0};
      solver->substep(input);
      const SolverState state = read(*solver);
      EXPECT_EQ(state.position_m[0], glm::vec3(0.0f));
      EXPECT_LE(glm::distance(glm::dvec3(state.position_m[1]), x1), 5e-7) << name;
      EXPECT_LE(glm::distance(glm::dvec3(state.position_m[2]), x2), 5e-7) << name;
      EXPECT_LE(glm::distance(glm::dvec3(state.velocity_mps[2]), (x2 - glm::dvec3(2.0, 0.0, 0.0)) / 0.1),
                1e-5);
    }
  }
}

// A stiffness is the share of an error that a substep takes back, whatever the number of iterations. A push
// of 10 m/s^2 in 0.1 s is 0.1 m; one constraint alone resists it: the only segment, or the bend of a limp
// one.
TEST_F(PositionLaws, StiffnessIsTheShareThatASubstepTakesBack) {
  const Groom segment = groom_from({{{0.f, 0.f, 0.f}, {1.f, 0.f, 0.f}}}, Pinning::Root);
  const Groom bend = groom_from({{{0.f, 0.f, 0.f}, {1.f, 0.f, 0.f}, {2.f, 0.f, 0.f}}}, Pinning::Root);
  StepInput input;
  input.h_s = 0.1;
  input.gravity_mps2 = {-10.0, 0.0, 0.0};
  for (const SolverHost& host : {kReferenceHost, kLanesHost}) {
    for (const double share : {0.0, 0.3, 0.75}) {
      for (const double iterations : {1.0, 7.0}) {
        for (const auto& [groom, stretch, bending] :
             {std::tuple(&segment, share, 0.0), std::tuple(&bend, 0.0, share)}) {
          auto solver = make({*find_solver("pbd"), host}, *groom,
                             {{"iterations", iterations},
                              {"air_drag_per_s", 0.0},
                              {"style_stiffness_per_s2", 0.0},
                              {"max_speed_mps", 1000.0},
                              {"stretch_stiffness", stretch},
                              {"bend_stiffness", bending}});
          solver->substep(input);
          const SolverState state = read(*solver);
          const double tip_m = static_cast<double>(state.position_m.size() - 1) - 0.1 * (1.0 - share);
          EXPECT_NEAR(state.position_m.back().x, tip_m, 1e-6)
              << host.name() << " " << share << " " << iterations;
        }
      }
    }
  }
}

// Each segment carries the weight below it and gives way by compliance times that, whatever the substep: the
// units are true. (Drag takes part of a step's gravity away while it lasts, so there is none here.)
TEST_F(PositionLaws, ACompliantStrandHangsByHookesLaw) {
  constexpr double kSegmentM = 0.1;
  constexpr double kDensityKgpm = 0.01;
  constexpr double kComplianceMpn = 0.1;
  constexpr double kGravityMps2 = 9.81;
  const Groom groom =
      groom_from({{{0.f, 0.f, 0.f}, {0.f, -0.1f, 0.f}, {0.f, -0.2f, 0.f}, {0.f, -0.3f, 0.f}}}, Pinning::Root);
  for (const SolverHost& host : solver_hosts()) {
    for (const double h_s : {1.0 / 60.0, 1.0 / 240.0}) {
      auto solver = make({*find_solver("xpbd"), host}, groom,
                         {{"iterations", 64.0},
                          {"air_drag_per_s", 0.0},
                          {"style_stiffness_per_s2", 0.0},
                          {"stretch_compliance_m_per_n", kComplianceMpn},
                          {"bend_compliance_m_per_n", 1e9},
                          {"linear_density_kg_per_m", kDensityKgpm}});
      StepInput input;
      input.h_s = h_s;
      for (int step = 0; step < 20.0 / h_s; ++step) solver->substep(input);
      const SolverState state = read(*solver);
      for (int i = 1; i <= 3; ++i) {
        const double carried_kg = kDensityKgpm * kSegmentM * (3 - i + 0.5);
        const double expected_m = kComplianceMpn * carried_kg * kGravityMps2;
        const double stretch_m = state.position_m[i - 1].y - state.position_m[i].y - kSegmentM;
        EXPECT_NEAR(stretch_m, expected_m, 0.01 * expected_m) << "segment " << i << ", h " << h_s;
      }
    }
  }
}

// An iteration passes a pull on by about one vertex, and a substep of a quarter moves a sixteenth as far
// under the same force: what is left falls.
TEST_F(PositionLaws, IterationsAndSubstepsTakeTheStretchAway) {
  for (const char* name : {"pbd", "xpbd"}) {
    for (const SolverHost& host : kernel_hosts()) {
      const SolverKind kind{*find_solver(name), host};
      SCOPED_TRACE(kind.name());
      const double few = stretch_under_motion(kind, 2.0, 1);
      const double more = stretch_under_motion(kind, 25.0, 1);
      const double with_substeps = stretch_under_motion(kind, 2.0, 4);
      EXPECT_LT(more, 0.25 * few);
      EXPECT_LT(with_substeps, 0.25 * few);
    }
  }
}

}  // namespace
}  // namespace strandcast::position_laws_test
