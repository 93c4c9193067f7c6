// Masses and springs: where explicit steps become unstable, periods and damping of each integrator, order of
// convergence, energy, and statics against theory.
#include <algorithm>
#include <cmath>
#include <complex>
#include <glm/gtx/quaternion.hpp>
#include <numbers>

#include "server/report/swing_fit.h"
#include "server/sim/solvers/mass_spring/mass_spring.h"
#include "tests/support/solver_fixture.h"

namespace strandcast::mass_spring_test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using Complex = std::complex<double>;

constexpr double kSymplecticEuler = 0.0;
constexpr double kVerlet = 1.0;
constexpr double kBackwardEuler = 2.0;
constexpr double kNoLimit = 10.0;

/// A straight strand from the head joint, clamped at its first vertex.
Groom straight_strand(uint32_t vertex_count, double segment_m, const glm::dvec3& direction) {
  std::vector<glm::vec3> strand;
  for (uint32_t i = 0; i < vertex_count; ++i) strand.emplace_back(direction * (segment_m * i));
  return groom_from({strand}, Pinning::Root);
}

/// Springs alone: no drag, no pull, no limits; what is given comes on top.
SolverParameters bare(const SolverParameters& given) {
  SolverParameters parameters = {{"air_drag_per_s", 0.0},
                                 {"style_stiffness_per_s2", 0.0},
                                 {"max_speed_mps", 1000.0},
                                 {"stretch_limit", kNoLimit},
                                 {"stretch_damping_ns_per_m", 0.0},
                                 {"bend_stiffness_nm_per_rad", 0.0},
                                 {"altitude_stiffness_n_per_m", 0.0}};
  for (const auto& [name, value] : given) parameters[name] = value;
  return parameters;
}

/// Every executor with every value.
std::vector<std::pair<SolverHost, double>> hosts_times(std::initializer_list<double> values) {
  std::vector<std::pair<SolverHost, double>> all;
  for (const SolverHost& host : kernel_hosts())
    for (const double value : values) all.emplace_back(host, value);
  return all;
}

class MassSpring : public SolverTest {
 protected:
  static SolverKind kind(const SolverHost& host) { return {*find_solver("mass_spring"), host}; }
  /// Without gusts and colliders, so that one program is compiled and not four.
  std::unique_ptr<Solver> make_plain(const SolverHost& host, const Groom& groom,
                                     const SolverParameters& given) {
    return make(kind(host), groom, given, {1.0, 0.0, 0.0, 0.0}, SceneFeatures{});
  }
  static Status check(const SolverParameters& given, double substep_s) {
    const SolverRow& row = **find_solver("mass_spring");
    return check_step(row, complete_parameters(row, given).value(), substep_s);
  }

  bool is_stable(const SolverHost& host, double integrator, double stretch_npm);
};

/// A helix of 12 mm radius and rise, turning by `angle_rad` per vertex.
std::vector<glm::vec3> curl_of(int vertex_count, double angle_rad) {
  constexpr double kRadiusM = 0.012;
  std::vector<glm::vec3> curl;
  for (int i = 0; i < vertex_count; ++i) {
    curl.emplace_back(kRadiusM * std::cos(angle_rad * i), -kRadiusM * i, kRadiusM * std::sin(angle_rad * i));
  }
  return curl;
}

// The set-up of the DFTL paper: 30 particles of 0.01 kg, 0.02 m apart, steps of 0.01 s.
constexpr uint32_t kFreeMasses = 29;
constexpr double kMassKg = 0.01;
constexpr double kSegmentM = 0.02;
constexpr double kStepS = 0.01;
constexpr double kTextbookLimitNpm = kMassKg / (kStepS * kStepS);

// A chain with one end held and half a mass at the other has modes sin(pi (j - 1/2) i / n) and the squares of
// frequency 4 k / m sin^2(pi (j - 1/2) / 2 n); the highest has j = n. h^2 w^2 = 4 there.
double chain_limit_npm() {
  return kTextbookLimitNpm / std::pow(std::cos(std::numbers::pi / (4.0 * kFreeMasses)), 2);
}

/// The same by power iteration on the chain's own matrix.
double chain_limit_by_iteration_npm() {
  std::vector<double> x(kFreeMasses);
  for (uint32_t i = 0; i < kFreeMasses; ++i) x[i] = i % 2 == 0 ? 1.0 : -1.0;
  double eigenvalue = 0.0;
  for (int iteration = 0; iteration < 20000; ++iteration) {
    std::vector<double> y(kFreeMasses);
    double squared = 0.0;
    for (uint32_t i = 0; i < kFreeMasses; ++i) {
      const bool is_tip = i + 1 == kFreeMasses;
      const double force = (is_tip ? 1.0 : 2.0) * x[i] - (i > 0 ? x[i - 1] : 0.0) - (is_tip ? 0.0 : x[i + 1]);
      y[i] = force / (is_tip ? 0.5 : 1.0);
      squared += y[i] * y[i];
    }
    eigenvalue = std::sqrt(squared);
    for (uint32_t i = 0; i < kFreeMasses; ++i) x[i] = y[i] / eigenvalue;
  }
  return 4.0 * kTextbookLimitNpm / eigenvalue;
}

/// Whether a chain that is pulled a little in the highest mode stays near its rest shape.
bool MassSpring::is_stable(const SolverHost& host, double integrator, double stretch_npm) {
  const Groom groom = straight_strand(kFreeMasses + 1, kSegmentM, {0.0, -1.0, 0.0});
  auto solver = make_plain(host, groom,
                           bare({{"integrator", integrator},
                                 {"stretch_stiffness_n_per_m", stretch_npm},
                                 {"linear_density_kg_per_m", kMassKg / kSegmentM},
                                 {"shortest_segment_m", kSegmentM}}));
  constexpr double kSeedM = 2e-6;
  constexpr double kGrowth = 100.0;
  constexpr int kSteps = 600;
  SolverState state = read(*solver);
  const std::vector<glm::vec3> rest = state.position_m;
  for (uint32_t i = 1; i <= kFreeMasses; ++i) {
    const double mode = std::sin(std::numbers::pi * (kFreeMasses - 0.5) * i / kFreeMasses);
    state.position_m[i].y += static_cast<float>(kSeedM * mode);
  }
  solver->write(state);
  for (int step = 0; step < kSteps; ++step) {
    solver->substep(calm_input(kStepS));
    if (step % 20 == 19 && largest_distance_m(read(*solver).position_m, rest) > kGrowth * kSeedM)
      return false;
  }
  return true;
}

TEST_F(MassSpring, ExplicitStepsFailExactlyWhereTheoryPutsTheLimit) {
  EXPECT_NEAR(chain_limit_npm() / chain_limit_by_iteration_npm(), 1.0, 1e-6);
  EXPECT_GT(chain_limit_npm(), kTextbookLimitNpm);
  for (const SolverHost& host : solver_hosts()) {
    for (const double integrator : {kSymplecticEuler, kVerlet}) {
      SCOPED_TRACE(fmt::format("{}, integrator {}", host.name(), integrator));
      double stable_npm = 0.9 * kTextbookLimitNpm;
      double unstable_npm = 1.1 * kTextbookLimitNpm;
      ASSERT_TRUE(is_stable(host, integrator, stable_npm));
      ASSERT_FALSE(is_stable(host, integrator, unstable_npm));
      while (unstable_npm - stable_npm > 2e-4 * kTextbookLimitNpm) {
        const double middle_npm = 0.5 * (stable_npm + unstable_npm);
        (is_stable(host, integrator, middle_npm) ? stable_npm : unstable_npm) = middle_npm;
      }
      fmt::print("{}, integrator {}: stable up to {:.3f} N/m, chain {:.3f}, m / h^2 {:.3f}\n", host.name(),
                 integrator, stable_npm, chain_limit_npm(), kTextbookLimitNpm);
      EXPECT_NEAR(stable_npm / chain_limit_npm(), 1.0, 1e-3);
      EXPECT_NEAR(stable_npm / kTextbookLimitNpm, 1.0, 0.01);
    }
  }
}

TEST_F(MassSpring, StepsBeyondTheLimitAreRefusedWithTwoWaysOut) {
  const auto parameters = [](double integrator, double stretch_npm) {
    return bare({{"integrator", integrator},
                 {"stretch_stiffness_n_per_m", stretch_npm},
                 {"linear_density_kg_per_m", kMassKg / kSegmentM},
                 {"shortest_segment_m", kSegmentM}});
  };
  for (const double integrator : {kSymplecticEuler, kVerlet}) {
    EXPECT_TRUE(check(parameters(integrator, 99.9), kStepS));
    const Status refused = check(parameters(integrator, 250.0), kStepS);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::BadInput);
    EXPECT_THAT(refused.error().message,
                AllOf(HasSubstr("250 N/m"), HasSubstr("up to 100 N/m"), HasSubstr("2 times as many substeps"),
                      HasSubstr("softer"), HasSubstr("integrator 2")));
    EXPECT_TRUE(check(parameters(integrator, 250.0), kStepS / 2));
  }
  EXPECT_TRUE(check(parameters(kBackwardEuler, 1e9), 0.1));
  // A damper alone: 2 h c <= m.
  SolverParameters damped = parameters(kVerlet, 0.0);
  damped["stretch_damping_ns_per_m"] = 0.49;
  EXPECT_TRUE(check(damped, kStepS));
  damped["stretch_damping_ns_per_m"] = 0.51;
  EXPECT_FALSE(check(damped, kStepS));
  // Defaults: the implicit integrator is theirs, and explicit steps at 60 Hz are out of reach.
  EXPECT_TRUE(check({}, 0.1));
  EXPECT_FALSE(check({{"integrator", kSymplecticEuler}}, 1.0 / 60.0));
}

// The limit holds for bending, altitude and dampers together, for any state: a curl shaken just below it
// never gains energy without end. 1.5 times above it, bending alone breaks the chain.
TEST_F(MassSpring, TheLimitCoversAllSpringsTogether) {
  const std::vector<glm::vec3> curl = curl_of(24, 1.1);
  const Groom groom = groom_from({curl}, Pinning::RootPair);
  const double segment_m = glm::distance(glm::dvec3(curl[0]), glm::dvec3(curl[1]));
  const auto largest_after = [&](double load, double stretch, double bend, double altitude, double damper) {
    const double unit_npm = 0.5 * segment_m / (kStepS * kStepS);
    const double damping = damper * unit_npm * kStepS / 2.0;
    auto parameters =
        bare({{"integrator", kSymplecticEuler},
              {"linear_density_kg_per_m", 0.5},
              {"shortest_segment_m", 0.999 * segment_m},
              {"stretch_stiffness_n_per_m", load * stretch * unit_npm},
              {"bend_stiffness_nm_per_rad", load * bend * unit_npm * segment_m * segment_m / kBendPerStretch},
              {"altitude_stiffness_n_per_m", load * altitude * unit_npm / kAltitudePerStretch},
              {"stretch_damping_ns_per_m", load * damping}});
    EXPECT_EQ(check(parameters, kStepS).ok(), load < 1.0);
    auto solver = make_plain(kReferenceHost, groom, parameters);
    SolverState state = read(*solver);
    const SolverState rest = state;
    for (size_t i = 2; i < state.position_m.size(); ++i) {
      for (int c = 0; c < 3; ++c)
        state.position_m[i][c] += 2e-4f * (unit_float(mix_u32(static_cast<uint32_t>(3 * i + c))) - 0.5f);
    }
    solver->write(state);
    double largest = 0.0;
    for (int step = 0; step < 1000; ++step) {
      solver->substep(calm_input(kStepS));
      if (step % 10 == 0)
        largest = std::fmax(largest, largest_distance_m(read(*solver).position_m, rest.position_m));
    }
    return largest;
  };
  const double calm_m = largest_after(0.98, 0.5, 0.3, 0.1, 0.1);
  EXPECT_LE(calm_m, 1e-3);
  EXPECT_LE(largest_after(0.98, 0.05, 0.95, 0.0, 0.0), 0.02);
  EXPECT_GE(largest_after(1.5, 0.05, 0.95, 0.0, 0.0), 0.1) << "the limit is far from where bending breaks";
  fmt::print("curl just below the limit: moved by {:.5f} m at most\n", calm_m);
}

TEST_F(MassSpring, ImplicitStepsSurviveAnyStiffness) {
  const Groom groom = make_test_groom({});
  const SolverRow& row = **find_solver("mass_spring");
  const SolverParameters defaults = complete_parameters(row, {}).value();
  for (const auto& [host, factor] : hosts_times({1.0, 1e3, 1e6, 1e9})) {
    SCOPED_TRACE(host.name());
    SolverParameters stiff = {{"stretch_limit", kNoLimit}};
    for (const char* name :
         {"stretch_stiffness_n_per_m", "bend_stiffness_nm_per_rad", "altitude_stiffness_n_per_m"})
      stiff[name] = factor * defaults.at(name);
    auto kernel = make_plain(host, groom, stiff);
    auto reference = make_plain(kReferenceHost, groom, stiff);
    double largest = 0.0;
    double apart_m = 0.0;
    for (int step = 1; step <= 120; ++step) {
      StepInput input = moving_input(step, 1.0 / 60.0);
      input.gusts.clear();
      input.colliders.clear();
      kernel->substep(input);
      reference->substep(input);
      const SolverState state = read(*kernel);
      const SolverState expected = read(*reference);
      ASSERT_TRUE(is_finite(state) && is_finite(expected));
      largest = std::max({largest, largest_stretch(groom, state), largest_stretch(groom, expected)});
      apart_m = std::fmax(apart_m, largest_distance_m(state.position_m, expected.position_m));
    }
    fmt::print("stiffness x {:g}: stretch {:.4f} without the limit, float and double {:.1e} m apart\n",
               factor, largest, apart_m);
    EXPECT_LE(largest, 0.01);
    // What a float forgets of the inertia beside the stiffest springs moves a strand no further than that.
    EXPECT_LE(apart_m, 1e-4);
  }
}

// One Newton step keeps lengths to first order in how far a segment turns, two to what the springs give.
TEST_F(MassSpring, TheSecondSolveTakesTheStretchAway) {
  const Groom groom = make_test_groom({});
  for (const SolverHost& host : kernel_hosts()) {
    SCOPED_TRACE(host.name());
    std::vector<double> largest;
    for (const double solves : {1.0, 2.0, 4.0}) {
      auto solver = make_plain(host, groom, {{"solves", solves}, {"stretch_limit", kNoLimit}});
      largest.push_back(0.0);
      for (int step = 1; step <= 240; ++step) {
        solver->substep(moving_input(step, 1.0 / 60.0));
        largest.back() = std::fmax(largest.back(), largest_stretch(groom, read(*solver)));
      }
      fmt::print("{} solves: stretch {:.4f} without the limit\n", solves, largest.back());
    }
    EXPECT_LE(largest[1], 0.1 * largest[0]);
    EXPECT_NEAR(largest[2] / largest[1], 1.0, 0.2);
  }
}

// Two masses, m and at the tip m / 2, on two springs: w^2 = (2 -+ sqrt(2)) k / m with the shapes (1,
// +-sqrt(2)). Explicit: |z| = 1 and sin(arg(z) / 2) = w h / 2. Backward Euler: z = 1 / (1 - i w h), which is
// an amplitude of (1 + (w h)^2)^(-pi / (w h)) per period.
TEST_F(MassSpring, TwoMassesSwingAsEachIntegratorSays) {
  constexpr double kSpacingM = 0.1;
  constexpr double kDensityKgpm = 0.1;
  constexpr double kAmplitudeM = 2e-3;
  const Groom groom = straight_strand(3, kSpacingM, {0.0, -1.0, 0.0});
  const double mass_kg = kDensityKgpm * kSpacingM;
  for (const SolverHost& host : solver_hosts()) {
    for (const double integrator : {kSymplecticEuler, kVerlet, kBackwardEuler}) {
      for (const double sign : {-1.0, 1.0}) {
        for (const double omega_h : {0.1, 0.5}) {
          SCOPED_TRACE(
              fmt::format("{}, integrator {}, mode {}, w h {}", host.name(), integrator, sign, omega_h));
          const double omega = omega_h / kStepS;
          const double stretch_npm = omega * omega * mass_kg / (2.0 + sign * std::sqrt(2.0));
          auto solver = make_plain(host, groom,
                                   bare({{"integrator", integrator},
                                         {"stretch_stiffness_n_per_m", stretch_npm},
                                         {"linear_density_kg_per_m", kDensityKgpm}}));
          SolverState state = read(*solver);
          state.position_m[1].y += static_cast<float>(kAmplitudeM);
          state.position_m[2].y += static_cast<float>(-sign * std::sqrt(2.0) * kAmplitudeM);
          solver->write(state);
          std::vector<double> q;
          for (int step = 0; step < 40; ++step) {
            solver->substep(calm_input(kStepS));
            const SolverState now = read(*solver);
            // Weighted with the masses, the modes are at right angles.
            q.push_back(static_cast<double>(now.position_m[1].y) + kSpacingM -
                        sign * std::sqrt(0.5) * (static_cast<double>(now.position_m[2].y) + 2.0 * kSpacingM));
          }
          const Complex expected = integrator == kBackwardEuler
                                       ? 1.0 / Complex(1.0, -omega_h)
                                       : std::polar(1.0, 2.0 * std::asin(0.5 * omega_h));
          const Complex found = swing_root(q);
          EXPECT_NEAR(std::arg(found) / std::arg(expected), 1.0, host.is_kernel() ? 2e-3 : 5e-4);
          EXPECT_NEAR(std::abs(found) / std::abs(expected), 1.0, host.is_kernel() ? 3e-4 : 5e-5);
          if (integrator != kBackwardEuler) continue;
          const double per_period = std::pow(std::abs(found), 2.0 * std::numbers::pi / omega_h);
          const double predicted = std::pow(1.0 + omega_h * omega_h, -std::numbers::pi / omega_h);
          EXPECT_NEAR(std::log(per_period) / std::log(predicted), 1.0, 0.02);
        }
      }
    }
  }
}

/// A short springy strand let go from the side: bends, stretches, swings.
class SwingingStrand {
 public:
  static constexpr double kSpacingM = 0.1;
  static constexpr double kDensityKgpm = 0.1;
  static constexpr double kStretchNpm = 20.0;
  static constexpr double kBendNmprad = 2e-3;
  static constexpr uint32_t kVertices = 5;

  static SolverParameters parameters(double integrator) {
    return bare({{"integrator", integrator},
                 {"stretch_stiffness_n_per_m", kStretchNpm},
                 {"bend_stiffness_nm_per_rad", kBendNmprad},
                 {"linear_density_kg_per_m", kDensityKgpm}});
  }
};

/// Kinetic, stretch, bending and, with gravity along -y, potential energy of one strand with the numbers of
/// SwingingStrand, clamped at its first vertex.
double energy_j(const SolverState& state, const std::vector<glm::vec3>& rest, double gravity_mps2) {
  double energy = 0.0;
  glm::dvec3 groomed_before(0.0);
  glm::dvec3 strain_before(0.0);
  for (size_t i = 1; i < rest.size(); ++i) {
    const glm::dvec3 groomed_edge = glm::dvec3(rest[i]) - glm::dvec3(rest[i - 1]);
    const glm::dvec3 groomed = glm::normalize(groomed_edge);
    const double length = glm::length(groomed_edge);
    const double mass = SwingingStrand::kDensityKgpm * length * (i + 1 < rest.size() ? 1.0 : 0.5);
    const glm::dvec3 velocity(state.velocity_mps[i]);
    const glm::dvec3 edge = glm::dvec3(state.position_m[i]) - glm::dvec3(state.position_m[i - 1]);
    const double stretch = glm::length(edge) - length;
    // Where the edge would rest: turned with the edge before.
    const glm::dvec3 target =
        i == 1 ? groomed
               : glm::length(strain_before) *
                     (glm::rotation(groomed_before, glm::normalize(strain_before)) * groomed);
    const glm::dvec3 bend = edge / length - target;
    energy += 0.5 * mass * glm::dot(velocity, velocity) +
              0.5 * SwingingStrand::kStretchNpm * stretch * stretch +
              (i == 1 ? 1.0 : 0.5) * SwingingStrand::kBendNmprad * glm::dot(bend, bend) +
              mass * gravity_mps2 * static_cast<double>(state.position_m[i].y);
    groomed_before = groomed;
    strain_before = edge / length;
  }
  return energy;
}

TEST_F(MassSpring, ErrorsFallWithTheStepAsTheOrderSays) {
  const Groom groom = straight_strand(SwingingStrand::kVertices, SwingingStrand::kSpacingM, {1.0, 0.0, 0.0});
  constexpr double kEndS = 0.32;
  const auto end_of = [&](double integrator, double h_s) {
    auto solver = make_plain(kReferenceHost, groom, SwingingStrand::parameters(integrator));
    StepInput input = calm_input(h_s);
    input.gravity_mps2 = {0.0, -9.81, 0.0};
    for (int step = 0; step < std::lround(kEndS / h_s); ++step) solver->substep(input);
    return read(*solver).position_m;
  };
  const auto exact = end_of(kVerlet, kEndS / 16384);
  for (const auto& [integrator, order] : std::vector<std::pair<double, double>>{
           {kSymplecticEuler, 1.0}, {kVerlet, 2.0}, {kBackwardEuler, 1.0}}) {
    const double coarse_m = largest_distance_m(end_of(integrator, kEndS / 256), exact);
    const double fine_m = largest_distance_m(end_of(integrator, kEndS / 512), exact);
    const double measured = std::log2(coarse_m / fine_m);
    EXPECT_NEAR(measured, order, 0.2) << "integrator " << integrator;
    fmt::print("integrator {}: order {:.3f}, error {:.2e} m at {:.2e} s\n", integrator, measured, fine_m,
               kEndS / 512);
  }
}

TEST_F(MassSpring, EnergyIsKeptByExplicitStepsAndNeverGrowsInImplicitOnes) {
  const glm::dvec3 along(1.0, 0.0, 0.0);
  constexpr double kGravityMps2 = 9.81;
  const Groom groom = straight_strand(SwingingStrand::kVertices, SwingingStrand::kSpacingM, along);
  StepInput input = calm_input(1e-3);
  input.gravity_mps2 = {0.0, -kGravityMps2, 0.0};
  // What the swing turns over: the fall of the middle by half its length.
  const double swing_j = SwingingStrand::kDensityKgpm * 0.4 * kGravityMps2 * 0.2;
  for (const SolverHost& host : solver_hosts()) {
    for (const double integrator : {kSymplecticEuler, kVerlet, kBackwardEuler}) {
      SCOPED_TRACE(fmt::format("{}, integrator {}", host.name(), integrator));
      auto solver = make_plain(host, groom, SwingingStrand::parameters(integrator));
      double before = energy_j(read(*solver), groom.rest_position_m, kGravityMps2);
      double largest_rise_j = 0.0;
      double late_j = 0.0;
      double early_j = 0.0;
      constexpr int kSteps = 8000;
      for (int step = 0; step < kSteps; ++step) {
        solver->substep(input);
        const double energy = energy_j(read(*solver), groom.rest_position_m, kGravityMps2);
        largest_rise_j = std::fmax(largest_rise_j, energy - before);
        before = energy;
        if (step < kSteps / 8) early_j += energy / (kSteps / 8);
        if (step >= kSteps * 7 / 8) late_j += energy / (kSteps / 8);
      }
      fmt::print("{}, integrator {}: mean energy {:+.3f} % after 7 s, largest rise in a step {:.4f} %\n",
                 host.name(), integrator, 100.0 * (late_j - early_j) / swing_j,
                 100.0 * largest_rise_j / swing_j);
      if (integrator == kBackwardEuler) {
        EXPECT_LE(largest_rise_j, 1e-4 * swing_j);
        EXPECT_LT(late_j, early_j);
      } else {
        EXPECT_NEAR(late_j, early_j, 0.01 * swing_j);
      }
    }
  }
}

// The forces of bent joints are the gradient of an energy, however far the strand has turned from its groom.
TEST_F(MassSpring, ASwingingCurlKeepsItsEnergy) {
  constexpr double kGravityMps2 = 9.81;
  std::vector<glm::vec3> curl;
  for (int i = 0; i < 8; ++i) curl.emplace_back(0.08 * i, 0.04 * std::cos(1.2 * i), 0.04 * std::sin(1.2 * i));
  const Groom groom = groom_from({curl}, Pinning::Root);
  StepInput input = calm_input(5e-4);
  input.gravity_mps2 = {0.0, -kGravityMps2, 0.0};
  for (const SolverHost& host : solver_hosts()) {
    auto solver = make_plain(host, groom, SwingingStrand::parameters(kVerlet));
    const double begin_j = energy_j(read(*solver), curl, kGravityMps2);
    double least_j = begin_j;
    double most_j = begin_j;
    double lowest_m = 0.0;
    for (int step = 0; step < 2000; ++step) {  // before an edge turns to within 16 degrees of its reverse
      solver->substep(input);
      const SolverState state = read(*solver);
      const double energy = energy_j(state, curl, kGravityMps2);
      least_j = std::fmin(least_j, energy);
      most_j = std::fmax(most_j, energy);
      lowest_m = std::fmin(lowest_m, static_cast<double>(state.position_m.back().y));
    }
    // What the swing turns over: the fall of the middle by half of the depth that the tip reached.
    const double swing_j = SwingingStrand::kDensityKgpm * 0.56 * kGravityMps2 * 0.5 * -lowest_m;
    fmt::print("{}: energy of a curl that swings by {:.2f} m kept within {:.3f} %\n", host.name(), -lowest_m,
               100.0 * (most_j - least_j) / swing_j);
    EXPECT_LT(lowest_m, -0.3) << "it hardly moved";
    EXPECT_LE(most_j - least_j, 1e-3 * swing_j);
  }
}

// Explicit kernels are a second program: the same motion as the reference, over colliders and in gusts.
TEST_F(MassSpring, EveryIntegratorFollowsItsReferenceOnTheGpu) {
  for (const Pinning pinning : {Pinning::Root, Pinning::RootPair, Pinning::BothEnds}) {
    TestGroomDesc desc;
    desc.pinning = pinning;
    const Groom groom = make_test_groom(desc);
    SolverState end[3];
    for (const double integrator : {kSymplecticEuler, kVerlet, kBackwardEuler}) {
      const SolverParameters soft = {
          {"integrator", integrator},          {"style_stiffness_per_s2", 60.0},
          {"linear_density_kg_per_m", 0.1},    {"shortest_segment_m", 0.01},
          {"stretch_stiffness_n_per_m", 2.0},  {"stretch_damping_ns_per_m", 1e-3},
          {"bend_stiffness_nm_per_rad", 1e-5}, {"altitude_stiffness_n_per_m", 0.05}};
      ASSERT_TRUE(check(soft, 1.0 / 60.0));
      SolverState& state = end[std::lround(integrator)];
      for (const SolverHost& host : kernel_hosts()) {
        auto kernel = make(kind(host), groom, soft);
        auto reference = make(kind(kReferenceHost), groom, soft);
        for (int step = 1; step <= 10; ++step) {
          kernel->substep(moving_input(step, 1.0 / 60.0));
          reference->substep(moving_input(step, 1.0 / 60.0));
        }
        state = read(*kernel);
        const SolverState expected = read(*reference);
        EXPECT_LE(largest_distance_m(state.position_m, expected.position_m), 1e-5)
            << host.name() << ", integrator " << integrator;
        EXPECT_LE(largest_distance_m(state.velocity_mps, expected.velocity_mps), 1e-4)
            << host.name() << ", integrator " << integrator;
      }
    }
    EXPECT_GT(largest_distance_m(end[0].position_m, end[1].position_m), 1e-4);
    EXPECT_GT(largest_distance_m(end[1].position_m, end[2].position_m), 1e-4);
  }
}

// Forces that are no gradient of an energy would keep a limp curl moving for ever.
TEST_F(MassSpring, CurlsComeToRest) {
  const Groom groom = groom_from({curl_of(24, 0.5), curl_of(24, 1.1), curl_of(24, 1.6)}, Pinning::RootPair);
  for (const auto& [host, factor] : hosts_times({1.0, 1000.0})) {
    auto solver = make_plain(host, groom,
                             {{"style_stiffness_per_s2", 0.0},
                              {"air_drag_per_s", 2.0},
                              {"bend_stiffness_nm_per_rad", factor * 1e-6},
                              {"altitude_stiffness_n_per_m", factor * 3e-3}});
    StepInput input = calm_input(1.0 / 240.0);
    input.gravity_mps2 = {3.0, -9.81, 0.0};
    for (int step = 0; step < 6 * 240; ++step) solver->substep(input);
    double fastest_mps = 0.0;
    for (const glm::vec3& velocity : read(*solver).velocity_mps)
      fastest_mps = std::fmax(fastest_mps, static_cast<double>(glm::length(velocity)));
    fmt::print("bending x {}: curls still move at {:.1e} m/s\n", factor, fastest_mps);
    EXPECT_LE(fastest_mps, 0.01);
  }
}

// b theta'' = -g (L - s) cos(theta), theta(0) = 0, theta'(L) = 0, Gamma = g L^3 / b: tip of the solution.
struct CantileverShape {
  double gamma;
  double x;
  double y;
};

TEST_F(MassSpring, AngularSpringsBendAsTheBeam) {
  constexpr double kLengthM = 0.3;
  constexpr uint32_t kVertices = 33;
  const std::vector<CantileverShape> shapes = {{0.5, 0.997779, 0.062306},
                                               {1.0, 0.991246, 0.123471},
                                               {5.0, 0.846657, 0.495905},
                                               {20.0, 0.445232, 0.829881}};
  const HairConstants hair;
  const SolverRow& row = **find_solver("mass_spring");
  for (const SolverHost& host : solver_hosts()) {
    for (const CantileverShape& shape : shapes) {
      SCOPED_TRACE(fmt::format("{}, Gamma {}", host.name(), shape.gamma));
      const double segment_m = kLengthM / (kVertices - 1);
      SolverParameters parameters = row.as_hair(hair, segment_m, 1.0 / 60.0);
      // The hair's own bending in a gravity that gives this Gamma.
      const double weight_npm = shape.gamma * hair.bending_stiffness_nm2() / std::pow(kLengthM, 3);
      parameters["air_drag_per_s"] = 3.0;
      auto solver = make_plain(host, straight_strand(kVertices, segment_m, {1.0, 0.0, 0.0}), parameters);
      StepInput input = calm_input();
      input.gravity_mps2 = {0.0, -weight_npm / hair.linear_density_kgpm(), 0.0};
      constexpr double kSettlingS = 12.0;
      for (int step = 0; step < 60 * kSettlingS; ++step) solver->substep(input);
      const glm::dvec3 tip = glm::dvec3(read(*solver).position_m.back()) / kLengthM;
      const double off = std::hypot(tip.x - shape.x, tip.y + shape.y);
      const double height_over_width = -tip.y / tip.x / (shape.y / shape.x) - 1.0;
      fmt::print("{}, Gamma {}: H/W {:+.3f} %, tip off by {:.3f} % of the length\n", host.name(), shape.gamma,
                 100.0 * height_over_width, 100.0 * off);
      EXPECT_LE(std::abs(height_over_width), 0.01);
      EXPECT_LE(off, 0.005);
    }
  }
}

// Each spring carries the weight below it, whatever the integrator and the substep.
TEST_F(MassSpring, AStrandHangsByHookesLaw) {
  constexpr double kSpacingM = 0.1;
  constexpr double kDensityKgpm = 0.01;
  constexpr double kStretchNpm = 2.0;
  constexpr double kGravityMps2 = 9.81;
  const Groom groom = straight_strand(4, kSpacingM, {0.0, -1.0, 0.0});
  for (const SolverHost& host : solver_hosts()) {
    for (const auto& [integrator, h_s] : std::vector<std::pair<double, double>>{
             {kBackwardEuler, 1.0 / 60.0}, {kBackwardEuler, 1.0 / 240.0}, {kVerlet, 1.0 / 240.0}}) {
      auto solver = make_plain(host, groom,
                               bare({{"integrator", integrator},
                                     {"stretch_stiffness_n_per_m", kStretchNpm},
                                     {"stretch_damping_ns_per_m", 0.02},
                                     {"linear_density_kg_per_m", kDensityKgpm}}));
      StepInput input = calm_input(h_s);
      input.gravity_mps2 = {0.0, -kGravityMps2, 0.0};
      for (int step = 0; step < 10.0 / h_s; ++step) solver->substep(input);
      const SolverState state = read(*solver);
      for (int i = 1; i <= 3; ++i) {
        const double expected_m = kDensityKgpm * kSpacingM * (3 - i + 0.5) * kGravityMps2 / kStretchNpm;
        const double stretch_m =
            static_cast<double>(state.position_m[i - 1].y - state.position_m[i].y) - kSpacingM;
        EXPECT_NEAR(stretch_m / expected_m, 1.0, 1e-3) << "integrator " << integrator << ", segment " << i;
      }
    }
  }
}

/// Volumes spanned by four vertices in a row, over the rest ones: least of a strand.
double least_share_of_volume(const std::vector<glm::vec3>& now, const std::vector<glm::vec3>& rest) {
  double least = INFINITY;
  const auto volume = [](const std::vector<glm::vec3>& p, size_t i) {
    const glm::dvec3 a(p[i - 2] - p[i - 3]);
    return glm::dot(a, glm::cross(glm::dvec3(p[i - 1] - p[i - 2]), glm::dvec3(p[i] - p[i - 1])));
  };
  for (size_t i = 3; i < now.size(); ++i) least = std::fmin(least, volume(now, i) / volume(rest, i));
  return least;
}

// A curl pressed flat, with stretch springs alone, stays flat; altitude springs open it, to its own hand.
TEST_F(MassSpring, AltitudeSpringsOpenACollapsedCurl) {
  std::vector<glm::vec3> curl;
  for (int i = 0; i < 12; ++i)
    curl.emplace_back(0.01 * std::cos(1.3 * i), -0.008 * i, 0.01 * std::sin(1.3 * i));
  const Groom groom = groom_from({curl}, Pinning::RootPair);
  for (const SolverHost& host : solver_hosts()) {
    for (const bool has_altitude : {false, true}) {
      for (const double integrator : {kSymplecticEuler, kBackwardEuler}) {
        auto solver = make_plain(host, groom,
                                 bare({{"integrator", integrator},
                                       {"air_drag_per_s", 5.0},
                                       {"linear_density_kg_per_m", 0.1},
                                       {"stretch_stiffness_n_per_m", 1.0},
                                       {"altitude_stiffness_n_per_m", has_altitude ? 0.5 : 0.0}}));
        SolverState state = read(*solver);
        for (size_t i = 2; i < curl.size(); ++i) state.position_m[i].z *= 0.05f;
        solver->write(state);
        for (int step = 0; step < 3000; ++step) solver->substep(calm_input(2e-3));
        const double share = least_share_of_volume(read(*solver).position_m, curl);
        EXPECT_EQ(share > 0.9, has_altitude)
            << (host.name()) << ", integrator " << integrator << ": share of volume " << share;
      }
    }
  }
}

}  // namespace
}  // namespace strandcast::mass_spring_test
