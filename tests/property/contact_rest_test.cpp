// Strands whose roots lie inside of a collider come to rest like any others.
#include <algorithm>
#include <cmath>
#include <random>

#include "tests/support/solver_fixture.h"

namespace strandcast::contact_rest_test {
namespace {

constexpr double kRadiusM = 0.095;

Groom make_buried(uint32_t strand_count, double depth_m, double segment_m, uint32_t vertex_count,
                  double lift) {
  std::mt19937 random(11);
  std::normal_distribution<double> any(0.0, 1.0);
  Groom groom;
  groom.offset = {0};
  for (uint32_t s = 0; s < strand_count; ++s) {
    const glm::dvec3 out = glm::normalize(glm::dvec3(any(random), any(random), any(random)));
    glm::dvec3 point = (kRadiusM - depth_m) * out;
    const glm::dvec3 along = glm::dvec3(any(random), any(random), any(random));
    for (uint32_t i = 0; i < vertex_count; ++i) {
      groom.rest_position_m.emplace_back(point);
      groom.pinned.push_back(i == 0 ? 1 : 0);
      const glm::dvec3 up = glm::normalize(point);
      const glm::dvec3 flat = glm::normalize(along - glm::dot(along, up) * up);
      point += segment_m * glm::normalize(flat + lift * up);
    }
    groom.offset.push_back(static_cast<uint32_t>(groom.rest_position_m.size()));
  }
  return groom;
}

class BuriedRoots : public SolverTest {};

/// Strands of direct_rod that are still faster than this after 20 s.
size_t restless_count(Solver& solver, double rate_hz) {
  constexpr double kRestMps = 0.02;
  StepInput input;
  input.h_s = 1.0 / rate_hz;
  input.groom_gravity_in_head_mps2 = input.gravity_mps2;
  input.colliders = {{glm::vec3(0.0f), static_cast<float>(kRadiusM)}};
  for (int step = 0; step < 20 * rate_hz; ++step) solver.substep(input);
  SolverState before, after;
  solver.read(before);
  solver.substep(input);
  solver.read(after);
  std::vector<double> fastest_mps(solver.strand_count(), 0.0);
  for (size_t i = 0; i < after.position_m.size(); ++i) {
    double& fastest = fastest_mps[i % fastest_mps.size()];
    fastest = std::max<double>(fastest, rate_hz * glm::distance(after.position_m[i], before.position_m[i]));
  }
  return std::count_if(fastest_mps.begin(), fastest_mps.end(), [](double speed) { return speed > kRestMps; });
}

TEST_F(BuriedRoots, ComeToRest) {
  for (const double segment_m : {0.004, 0.008})
    for (const double lift : {0.0, 0.5})
      for (const double rate_hz : {60.0, 120.0}) {
        SCOPED_TRACE(fmt::format("segments of {} m, lifted by {}, {} Hz", segment_m, lift, rate_hz));
        auto solver =
            make({*find_solver("direct_rod"), kLanesHost}, make_buried(100, 0.007, segment_m, 16, lift));
        EXPECT_EQ(restless_count(*solver, rate_hz), 0u);
      }
}

}  // namespace
}  // namespace strandcast::contact_rest_test
