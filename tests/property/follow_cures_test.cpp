// The two faults of dynamic Follow-The-Leader that Woodhouse 2017, 5.2 reports, measured without and with
// their cures.
#include <complex>
#include <numbers>

#include "server/sim/strand_parameters.h"
#include "tests/support/solver_fixture.h"

namespace strandcast::follow_cures_test {
namespace {

/// Positions of one vertex, one per step.
using Track = std::vector<glm::dvec3>;

/// Mean square of the accelerations in the upper half of the frequencies that steps can show, above a quarter
/// of the step rate, m^2/s^4: a Hann window and a Fourier sum.
double jitter_m2ps4(const Track& track, double h_s) {
  const size_t count = track.size() - 2;
  double window_power = 0.0;
  std::vector<glm::dvec3> acceleration;
  for (size_t t = 0; t < count; ++t) {
    const double window =
        0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * (static_cast<double>(t) + 0.5) / count);
    window_power += window * window;
    acceleration.push_back(window * (track[t + 2] - 2.0 * track[t + 1] + track[t]) / (h_s * h_s));
  }
  double power = 0.0;
  for (size_t k = count / 4 + 1; k <= count / 2; ++k) {
    for (int axis = 0; axis < 3; ++axis) {
      std::complex<double> sum = 0.0;
      for (size_t t = 0; t < count; ++t)
        sum += acceleration[t][axis] *
               std::polar(1.0, -2.0 * std::numbers::pi * static_cast<double>(k * t) / count);
      power += (2 * k == count ? 1.0 : 2.0) * std::norm(sum);
    }
  }
  return power / (static_cast<double>(count) * window_power);
}

class FollowCures : public SolverTest {
 protected:
  struct Jitter {
    double shaken_m2ps4 = 0.0;  // while the head is shaken
    double still_m2ps4 = 0.0;   // afterwards, with the head still
    double excess_m = -1.0;     // of a length over 1e-5 of it, in all steps
  };

  /// The head moves to and fro, turning round every 50 ms for 2 s, then stands still for 0.8 s; 48 frames of
  /// either part, as seen from the head.
  Jitter shake(const SolverKind& kind, const Groom& groom, const SolverParameters& parameters,
               double speed_mps, double rate_hz) {
    constexpr double kReversalS = 0.05;
    constexpr double kShakenS = 2.0;
    constexpr double kWindowS = 0.8;
    auto solver = make(kind, groom, parameters);
    const double h_s = 1.0 / rate_hz;
    const int shaken_steps = static_cast<int>(std::lround(kShakenS * rate_hz));
    const int window_steps = static_cast<int>(std::lround(kWindowS * rate_hz));
    const uint32_t strand_count = groom.strand_count();
    std::vector<Track> shaken(groom.rest_position_m.size());
    std::vector<Track> still(groom.rest_position_m.size());
    Jitter jitter;
    for (int step = 0; step < shaken_steps + window_steps; ++step) {
      StepInput input;
      input.h_s = h_s;
      input.groom_gravity_in_head_mps2 = input.gravity_mps2;
      const bool is_back = static_cast<int>(std::floor((step + 0.5) * h_s / kReversalS)) % 2 != 0;
      if (step < shaken_steps) input.head_shift_m.x = (is_back ? -speed_mps : speed_mps) * h_s;
      solver->substep(input);
      const SolverState state = read(*solver);
      jitter.excess_m = std::fmax(jitter.excess_m, length_excess_m(groom, state, 1e-5));
      if (step < shaken_steps - window_steps) continue;
      std::vector<Track>& tracks = step < shaken_steps ? shaken : still;
      for (size_t i = 0; i < tracks.size(); ++i) tracks[i].emplace_back(state.position_m[i]);
    }
    const size_t first = 2 * strand_count;
    for (size_t i = first; i < still.size(); ++i) {
      jitter.shaken_m2ps4 += jitter_m2ps4(shaken[i], h_s) / static_cast<double>(still.size() - first);
      jitter.still_m2ps4 += jitter_m2ps4(still[i], h_s) / static_cast<double>(still.size() - first);
    }
    return jitter;
  }
};

// Woodhouse 2017: "under very strong force which rapidly changes direction" strands shake on by themselves.
// They do at small steps, where the correction damps less; without thrusts they do not.
TEST_F(FollowCures, WithoutThrustsStrandsComeToRestAfterFastReversals) {
  const Groom groom = make_test_groom({});
  struct Case {
    const char* name;
    SolverHost host;
    double speed_mps, rate_hz, style_per_s2, factor;
  };
  const std::vector<Case> cases = {
      {"dftl", kGlHost, 1.5, 120.0, 400.0, 100.0},
      {"dftl", kLanesHost, 1.5, 60.0, 400.0, 1.0},
      {"dftl", kLanesHost, 3.0, 60.0, 400.0, 1.0},
      {"dftl", kLanesHost, 1.5, 120.0, 400.0, 100.0},
      {"dftl", kLanesHost, 3.0, 120.0, 400.0, 100.0},
      {"dftl", kLanesHost, 1.5, 240.0, 400.0, 100.0},
      {"dftl", kLanesHost, 3.0, 240.0, 0.0, 100.0},
      {"dftl", kReferenceHost, 1.5, 120.0, 400.0, 100.0},
      {"dftl_parallel", kGlHost, 1.5, 120.0, 400.0, 100.0},
      {"dftl_parallel", kLanesHost, 1.5, 120.0, 400.0, 100.0},
  };
  for (const Case& test : cases) {
    SCOPED_TRACE(test.name);
    const SolverKind kind{*find_solver(test.name), test.host};
    const auto with_thrust = [&](double share) {
      return shake(kind, groom, {{"thrust_share", share}, {"style_stiffness_per_s2", test.style_per_s2}},
                   test.speed_mps, test.rate_hz);
    };
    const Jitter before = with_thrust(1.0);
    const Jitter after = with_thrust(0.0);
    fmt::print(
        "{:24} {:3} Hz, {} m/s, pull {:3}: jitter shaken {:8.0f} -> {:8.0f}, then still {:10.3f} -> {:6.3f}"
        " m^2/s^4\n",
        kind.name(), test.rate_hz, test.speed_mps, test.style_per_s2, before.shaken_m2ps4, after.shaken_m2ps4,
        before.still_m2ps4, after.still_m2ps4);
    EXPECT_LE(after.still_m2ps4, before.still_m2ps4 / test.factor);
    EXPECT_LE(after.shaken_m2ps4, 1.05 * before.shaken_m2ps4);
    EXPECT_LE(after.still_m2ps4, 3.0);  // of motions of 0.1 mm at 30 Hz, say
    EXPECT_LE(after.excess_m, 0.0) << "lengths are not exact";
  }
}

TEST_F(FollowCures, StrandsOfDifferentThicknessMoveDifferently) {
  // 8 x 8 equal strands, 5 mm apart, on a head that nods and sways in wind.
  constexpr int kSide = 8;
  std::vector<std::vector<glm::vec3>> strands;
  for (int s = 0; s < kSide * kSide; ++s) {
    std::vector<glm::vec3> strand;
    for (int i = 0; i < 16; ++i)
      strand.emplace_back(0.005f * (s % kSide), 0.1f - 0.016f * i, 0.005f * (s / kSide));
    strands.push_back(std::move(strand));
  }
  const Groom groom = groom_from(strands, Pinning::RootPair);
  const uint32_t strand_count = groom.strand_count();
  // All by lanes, and one of them by OpenGL.
  const std::vector<std::pair<const char*, SolverHost>> kinds = {
      {"dftl", kGlHost}, {"dftl", kLanesHost}, {"dftl_parallel", kLanesHost}, {"ftl", kLanesHost}};
  for (const auto& [name, host] : kinds) {
    SCOPED_TRACE(fmt::format("{}, {}", name, host.name()));
    double correlation[2] = {0.0, 0.0};
    double apart[2] = {0.0, 0.0};
    for (const int is_spread : {0, 1}) {
      auto solver = make({*find_solver(name), host}, groom, {{"thickness_spread", is_spread ? 0.2 : 0.0}});
      const SolverState groomed = read(*solver);
      double products = 0.0;
      double squares = 0.0;
      double apart_m2 = 0.0;
      double way_m2 = 0.0;
      for (int step = 1; step <= 360; ++step) {
        StepInput input = moving_input(step, 1.0 / 60.0);
        input.gusts.clear();
        input.colliders.clear();
        solver->substep(input);
        if (step <= 60) continue;
        const SolverState state = read(*solver);
        ASSERT_LE(length_excess_m(groom, state, 1e-5), 0.0);
        const glm::dvec3 head_mps = input.head_shift_m / input.h_s;
        const size_t tip = state.position_m.size() - strand_count;
        for (uint32_t s = 0; s < strand_count; ++s) {
          if (s % kSide == kSide - 1) continue;
          const glm::dvec3 a = glm::dvec3(state.velocity_mps[tip + s]) - head_mps;
          const glm::dvec3 b = glm::dvec3(state.velocity_mps[tip + s + 1]) - head_mps;
          products += glm::dot(a, b);
          squares += 0.5 * (glm::dot(a, a) + glm::dot(b, b));
          const auto way = [&](size_t i) {
            return glm::dvec3(state.position_m[i]) -
                   input.world_from_head_rotation * glm::dvec3(groomed.position_m[i]);
          };
          const glm::dvec3 difference = way(tip + s) - way(tip + s + 1);
          apart_m2 += glm::dot(difference, difference);
          way_m2 += glm::dot(way(tip + s), way(tip + s));
        }
      }
      correlation[is_spread] = products / squares;
      apart[is_spread] = std::sqrt(apart_m2 / way_m2);
    }
    fmt::print(
        "{:14} neighbours' tips: correlation {:.4f} -> {:.4f}, apart by {:.3f} -> {:.3f} of their way\n",
        name, correlation[0], correlation[1], apart[0], apart[1]);
    EXPECT_GT(correlation[0], 0.95) << "nothing to cure";
    EXPECT_GT(1.0 - correlation[1], 3.0 * (1.0 - correlation[0]));
    EXPECT_GT(apart[1], 2.0 * apart[0]);
    EXPECT_GT(apart[1], 0.1);
  }
}

// A hash of the root's place: within the spread, around 1, and the same bits on the GPU as in double.
TEST_F(FollowCures, ThicknessIsEvenlySpread) {
  const Groom groom = make_test_groom({.strand_count = 1000});
  double sum = 0.0;
  double least = 2.0;
  double most = 0.0;
  for (uint32_t s = 0; s < groom.strand_count(); ++s) {
    const double factor = thickness_factor(groom.rest_position_m[groom.offset[s]], 0.2);
    sum += factor / groom.strand_count();
    least = std::fmin(least, factor);
    most = std::fmax(most, factor);
  }
  EXPECT_NEAR(sum, 1.0, 4.0 * 0.2 / std::sqrt(3.0 * groom.strand_count()));
  EXPECT_NEAR(least, 0.8, 0.004);
  EXPECT_NEAR(most, 1.2, 0.004);
}

TEST_F(FollowCures, AllVersionsOfASolverTakeTheSameThickness) {
  const Groom groom = make_test_groom({});
  for (const char* name : {"dftl", "dftl_parallel", "ftl"}) {
    SCOPED_TRACE(name);
    const SolverParameters varied = {{"thickness_spread", 0.3}, {"style_stiffness_per_s2", 120.0}};
    std::vector<std::unique_ptr<Solver>> kernels;
    for (const SolverHost& host : kernel_hosts())
      kernels.push_back(make({*find_solver(name), host}, groom, varied));
    auto reference = make({*find_solver(name), kReferenceHost}, groom, varied);
    auto even = make({*find_solver(name), kReferenceHost}, groom, {{"style_stiffness_per_s2", 120.0}});
    for (int step = 1; step <= 6; ++step) {
      for (const auto& kernel : kernels) kernel->substep(moving_input(step, 1.0 / 60.0));
      for (Solver* solver : {reference.get(), even.get()}) solver->substep(moving_input(step, 1.0 / 60.0));
    }
    for (const auto& kernel : kernels)
      EXPECT_LE(largest_distance_m(read(*kernel).position_m, read(*reference).position_m), 1e-5);
    EXPECT_GT(largest_distance_m(read(*even).position_m, read(*reference).position_m), 1e-3);
  }
}

}  // namespace
}  // namespace strandcast::follow_cures_test
