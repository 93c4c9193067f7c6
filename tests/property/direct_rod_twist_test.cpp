// direct_rod where twist counts: curls as springs, rest shapes in space, frames.
#include "tests/property/direct_rod_fixture.h"
#include "tests/support/claims.h"

namespace strandcast::direct_rod_twist_test {
namespace {

struct Helix {
  double radius_m = 5e-3;
  double pitch_m = 2e-3;
  int coil_count = 4;
  int vertices_per_coil = 15;

  double wire_m() const { return coil_count * std::hypot(2.0 * std::numbers::pi * radius_m, pitch_m); }
};

/// A curl with its axis downwards, along -y.
std::vector<glm::vec3> helix_strand(const Helix& helix) {
  std::vector<glm::vec3> strand;
  for (int i = 0; i <= helix.coil_count * helix.vertices_per_coil; ++i) {
    const double coils = static_cast<double>(i) / helix.vertices_per_coil;
    const double angle = 2.0 * std::numbers::pi * coils;
    strand.emplace_back(helix.radius_m * std::cos(angle), -helix.pitch_m * coils,
                        helix.radius_m * std::sin(angle));
  }
  return strand;
}

/// Height of the centre of the last coil.
double last_coil_m(const Helix& helix, const std::vector<glm::vec3>& position) {
  double sum = 0.0;
  for (int i = 0; i < helix.vertices_per_coil; ++i)
    sum += static_cast<double>(position[position.size() - 1 - static_cast<size_t>(i)].y);
  return sum / helix.vertices_per_coil;
}

class RodTwist : public DirectRod {
 protected:
  static void advance(Solver& rod, const StepInput& input, double time_s) {
    for (int step = 0; step < time_s / input.h_s; ++step) rod.substep(input);
  }
};

// The wire of a flat coil spring works in torsion: k = G r^4 / (4 N R^3), extended by m g / (2 k) by its own
// weight, at the middle of the last coil by 1 - (1 / 2N)^2 of that. Coils are polygons of 15 sides, whose
// length and distance from the axis are within 1.5 % of the circle's.
TEST_F(RodTwist, ACurlIsASpring) {
  constexpr double kLoadMps2 = 0.5;
  const Helix helix;
  const auto strand = helix_strand(helix);
  const Groom groom = groom_from({strand}, Pinning::Root);
  for (const SolverHost& host : solver_hosts()) {
    for (const double ratio : {0.0, 0.45, 1.2}) {
      SCOPED_TRACE(fmt::format("{}, Poisson's ratio {}", host.name(), ratio));
      const double shear_pa = kHairModulusPa / (2.0 * (1.0 + ratio));
      const double stiffness_npm =
          shear_pa * std::pow(kRadiusM, 4) / (4.0 * helix.coil_count * std::pow(helix.radius_m, 3));
      const double expected_m = kMassPerLengthKgpm * helix.wire_m() * kLoadMps2 / (2.0 * stiffness_npm) *
                                (1.0 - std::pow(0.5 / helix.coil_count, 2));
      auto rod = make_rod(host, groom, {{"poisson_ratio", ratio}, {"air_drag_per_s", 20.0}});
      advance(*rod, falling_input(1.0 / 60.0, {0.0, -kLoadMps2, 0.0}), 8.0);
      const double extended_m = last_coil_m(helix, strand) - last_coil_m(helix, read(*rod).position_m);
      EXPECT_NEAR(extended_m / expected_m, 1.0, claims::kCurlSpring);
      fmt::print("{}, Poisson's ratio {}: extension {:.4f} of the spring's\n", host.name(), ratio,
                 extended_m / expected_m);
    }
  }
}

// Stress and twist of a bouncing curl are as stiff as its wire: one linear solve per step follows them as
// well as four.
TEST_F(RodTwist, OneSolvePerStepFollowsABouncingCurl) {
  const Helix helix;
  const Groom groom = groom_from({helix_strand(helix)}, Pinning::Root);
  const StepInput input = falling_input(1.0 / 60.0, {0.0, -0.5, 0.0});
  for (const SolverHost& host : solver_hosts()) {
    SolverParameters undamped = {{"air_drag_per_s", 0.0}, {"bending_damping_s", 0.0}};
    auto rod = make_rod(host, groom, undamped);
    undamped["solves"] = 4.0;
    auto exact = make_rod(kReferenceHost, groom, undamped);
    const double start_m = last_coil_m(helix, read(*rod).position_m);
    double amplitude_m = 0.0;
    double apart_m = 0.0;
    for (int step = 0; step < 60; ++step) {
      rod->substep(input);
      exact->substep(input);
      const double expected_m = last_coil_m(helix, read(*exact).position_m);
      amplitude_m = std::max(amplitude_m, std::abs(expected_m - start_m));
      apart_m = std::max(apart_m, std::abs(last_coil_m(helix, read(*rod).position_m) - expected_m));
    }
    EXPECT_LE(apart_m, 0.005 * amplitude_m);
    fmt::print("{}: {:.2f} % of the bounce apart\n", host.name(), 100.0 * apart_m / amplitude_m);
  }
}

// The same motion with ever shorter steps: curls are of second order too.
TEST_F(RodTwist, ASwayingCurlIsOfSecondOrderInTime) {
  constexpr double kTimeS = 0.5;
  Helix helix;
  helix.coil_count = 2;
  helix.vertices_per_coil = 12;
  const Groom groom = groom_from({helix_strand(helix)}, Pinning::Root);
  const auto tip_after = [&](double rate_hz) {
    const auto head_m = [](double t) { return 0.02 * std::pow(std::sin(std::numbers::pi * t), 4); };
    auto rod = make_rod(kReferenceHost, groom, {{"air_drag_per_s", 1.0}});
    StepInput input;
    input.h_s = 1.0 / rate_hz;
    for (int step = 1; step <= std::lround(kTimeS * rate_hz); ++step) {
      const double t = step * input.h_s;
      const double ramp = std::min(1.0, t / 0.2);
      input.gravity_mps2 = {0.0, -0.2 * kGravityMps2 * ramp * ramp * (3.0 - 2.0 * ramp), 0.0};
      input.head_shift_m = {head_m(t) - head_m(t - input.h_s), 0.0, 0.0};
      rod->substep(input);
    }
    return glm::dvec3(read(*rod).position_m.back());
  };
  const glm::dvec3 expected = tip_after(7680.0);
  const double coarse_m = glm::distance(tip_after(120.0), expected);
  const double middle_m = glm::distance(tip_after(240.0), expected);
  const double fine_m = glm::distance(tip_after(480.0), expected);
  EXPECT_GE(coarse_m / middle_m, 3.0);
  EXPECT_GE(middle_m / fine_m, 3.0);
  fmt::print("tip error {:.2e} m at 120 Hz, {:.2e} at 240, {:.2e} at 480\n", coarse_m, middle_m, fine_m);
}

// Curvature and torsion of the groom are the rod's own: pulled straight and let go, the curl comes back.
TEST_F(RodTwist, ACurlPulledStraightComesBack) {
  const Helix helix;
  const auto strand = helix_strand(helix);
  const Groom groom = groom_from({strand}, Pinning::Root);
  for (const SolverHost& host : solver_hosts()) {
    auto rod = make_rod(host, groom, {{"air_drag_per_s", 20.0}});
    SolverState state = read(*rod);
    const std::vector<glm::vec3> groomed = state.position_m;
    float length_m = 0.0f;
    for (size_t i = 1; i < groomed.size(); ++i) {
      length_m += glm::distance(groomed[i], groomed[i - 1]);
      state.position_m[i] = groomed[0] - glm::vec3(0.0f, length_m, 0.0f);
    }
    rod->write(state);
    advance(*rod, calm_input(), 12.0);
    const double away_m = largest_distance_m(read(*rod).position_m, groomed);
    EXPECT_LE(away_m, 1e-3 * helix.radius_m);
    fmt::print("{}: {:.1e} m from the groom\n", host.name(), away_m);
  }
}

// A wide, limp curl on a head that shakes with 10 g and turns by 2 rad to either side: no coil stays wound
// the wrong way.
TEST_F(RodTwist, AShakenCurlComesBack) {
  constexpr double kShakeRadps = 2.0 * std::numbers::pi * 3.0;
  constexpr double kShakenS = 2.0;
  constexpr double kRateHz = 60.0;
  Helix helix;
  helix.radius_m = helix.pitch_m = 1.5e-2;
  helix.vertices_per_coil = 12;
  const Groom groom = groom_from({helix_strand(helix)}, Pinning::Root);
  const auto head_m = [&](double t) {
    return 10.0 * kGravityMps2 / (kShakeRadps * kShakeRadps) * std::sin(kShakeRadps * std::min(t, kShakenS));
  };
  for (const SolverHost& host : solver_hosts()) {
    auto rod = make_rod(host, groom, {});
    const std::vector<glm::vec3> groomed = read(*rod).position_m;
    double swing_m = 0.0;
    for (int step = 1; step <= 25.0 * kRateHz; ++step) {
      const double t = step / kRateHz;
      StepInput input = calm_input(1.0 / kRateHz);
      input.head_shift_m = {head_m(t) - head_m(t - input.h_s), 0.0, 0.0};
      if (t < kShakenS) {
        input.world_from_head_rotation = glm::angleAxis(2.0 * std::sin(8.0 * t), glm::dvec3(0.0, 1.0, 0.0));
        swing_m = std::max(swing_m, largest_distance_m(read(*rod).position_m, groomed));
      }
      rod->substep(input);
    }
    const double away_m = largest_distance_m(read(*rod).position_m, groomed);
    EXPECT_GE(swing_m, 0.5 * helix.wire_m());
    EXPECT_LE(away_m, 1e-3 * helix.radius_m);
    fmt::print("{}: swung by {:.2f} m, {:.1e} m from the groom\n", host.name(), swing_m, away_m);
  }
}

TEST_F(RodTwist, TwistDoesNothingToAStraightStrand) {
  const Groom groom = straight_strand(16, {1.0, 0.0, 0.0});
  auto soft = make_rod(kReferenceHost, groom, {{"poisson_ratio", 5.0}});
  auto stiff = make_rod(kReferenceHost, groom, {{"poisson_ratio", 0.0}});
  for (int step = 1; step <= 60; ++step) {
    StepInput input = falling_input(1.0 / 60.0, {0.0, -kGravityMps2, 0.0});
    input.head_shift_m = {0.0, 0.0, 0.02 * std::sin(0.2 * step)};
    soft->substep(input);
    stiff->substep(input);
  }
  EXPECT_LE(largest_distance_m(read(*soft).position_m, read(*stiff).position_m), 1e-6 * kLengthM);
}

}  // namespace
}  // namespace strandcast::direct_rod_twist_test
