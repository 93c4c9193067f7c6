#include "server/report/analytic_tests.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace strandcast {
namespace {

constexpr double kTurns = 5.0;
constexpr double kCoilRadiusM = 5e-3;
constexpr double kPitchM = 2e-3;  // per turn
constexpr double kCurlGravityMps2 = 9.81;
constexpr double kCurlDragPerS = 20.0;
constexpr double kCurlSettlingS = 6.0;

std::vector<glm::dvec3> hanging_helix(uint32_t vertex_count) {
  std::vector<glm::dvec3> points;
  for (uint32_t i = 0; i < vertex_count; ++i) {
    const double turn = kTurns * i / (vertex_count - 1);
    const double angle = 2.0 * std::numbers::pi * turn;
    points.emplace_back(kCoilRadiusM * (std::cos(angle) - 1.0), -kPitchM * turn,
                        kCoilRadiusM * std::sin(angle));
  }
  return points;
}

}  // namespace

bool has_twist(const SolverRow& row) {
  return std::any_of(row.parameters.begin(), row.parameters.end(), [](const SolverParameterInfo& info) {
    return info.name.starts_with("poisson") || info.name.starts_with("twist") ||
           info.name.starts_with("shear");
  });
}

AnalyticResult run_curl(const Workbench& workbench, const RunSetting& setting) {
  const std::vector<glm::dvec3> helix = hanging_helix(setting.vertex_count);
  RunPhysics physics;
  physics.length_m = 0.0;
  for (size_t i = 1; i < helix.size(); ++i) physics.length_m += glm::distance(helix[i], helix[i - 1]);
  physics.given = {{"air_drag_per_s", kCurlDragPerS}};
  const Groom groom = groom_of({helix}, Pinning::Root);
  AnalyticResult result;
  auto run = StrandRun::make(workbench, setting, physics, groom);
  if (!run) {
    result.note = run.error().to_string();
    return result;
  }
  StepInput input;
  input.gravity_mps2 = {0.0, -kCurlGravityMps2, 0.0};
  for (int step = 0; step < kCurlSettlingS * setting.rate_hz; ++step) {
    run->step(input);
    result.stretch = std::max(result.stretch, largest_run_stretch(groom, run->state()));
  }
  const double weight_npm = physics.hair.linear_density_kgpm() * kCurlGravityMps2;
  const double length = physics.length_m;
  result.exact =
      weight_npm * kCoilRadiusM * kCoilRadiusM * length / (2.0 * physics.hair.twist_stiffness_nm2());
  result.value = (helix.back().y - static_cast<double>(run->state().position_m.back().y)) / length;
  result.error = std::abs(result.value / result.exact - 1.0);
  result.droop = result.value;
  return result;
}

}  // namespace strandcast
