#include "tests/bench/peers/row_bench.h"

#include <algorithm>
#include <vector>

#include "tests/support/sim_scene.h"

namespace strandcast {
namespace {

Result<std::unique_ptr<Solver>> make_solver(const SolverRow& row, const SolverParameters& given,
                                            Executor& executor) {
  ASSIGN_OR_RETURN(const SolverParameters complete, complete_parameters(row, given));
  SceneFeatures features;
  features.has_wind = true;
  return row.make(complete, {&executor, features});
}

}  // namespace

Groom bench_groom(uint32_t strand_count, uint32_t vertex_count) {
  TestGroomDesc desc;
  desc.strand_count = strand_count;
  desc.vertex_count = vertex_count;
  return make_test_groom(desc);
}

double iterations_of(const SolverRow& row) {
  for (const SolverParameterInfo& info : row.parameters)
    if (info.name == row.effort_parameter) return info.default_value;
  return 1.0;
}

Result<double> row_step_ms(const SolverRow& row, const Groom& groom, Executor& executor, int steps) {
  constexpr double kStepS = 1.0 / 60.0;
  constexpr int kWarmUp = 5;
  ASSIGN_OR_RETURN(const auto solver, make_solver(row, {}, executor));
  RETURN_IF_ERROR(solver->load(groom, {1.0, 0.0, 0.0, 0.0}));
  std::vector<double> samples_ms;
  for (int step = 1; step <= kWarmUp + steps; ++step) {
    StepInput input = moving_input(step, kStepS);
    input.gusts.clear();
    input.colliders.clear();
    const double ms = timed_ms(executor, [&] { solver->substep(input); });
    if (step > kWarmUp) samples_ms.push_back(ms);
  }
  return *std::min_element(samples_ms.begin(), samples_ms.end());
}

Result<double> swing_stretch(const SolverRow& row, const SwingSetup& setup, Executor& executor) {
  constexpr double kLengthM = 0.3;
  const double segment_m = kLengthM / (setup.vertex_count - 1);
  std::vector<glm::vec3> strand;
  for (uint32_t i = 0; i < setup.vertex_count; ++i) strand.emplace_back(0.1 + segment_m * i, 0.0, 0.0);
  const Groom groom = groom_from({strand}, Pinning::Root);
  SolverParameters given =
      known_parameters(row, {{"style_stiffness_per_s2", 0.0}, {"sag_free", 0.0}, {"air_drag_per_s", 0.0}});
  if (row.as_hair)
    for (const auto& [name, value] : row.as_hair({}, segment_m, setup.step_s)) given[name] = value;
  ASSIGN_OR_RETURN(const auto solver, make_solver(row, given, executor));
  RETURN_IF_ERROR(solver->load(groom, {1.0, 0.0, 0.0, 0.0}));
  StepInput input;
  input.h_s = setup.step_s;
  SolverState state;
  double largest = 0.0;
  for (double time_s = 0.0; time_s < setup.seconds; time_s += setup.step_s) {
    solver->substep(input);
    solver->read(state);
    for (uint32_t i = 1; i < setup.vertex_count; ++i) {
      const double length_m =
          glm::distance(glm::dvec3(state.position_m[i]), glm::dvec3(state.position_m[i - 1]));
      largest = std::max(largest, length_m / segment_m - 1.0);
    }
  }
  return largest;
}

}  // namespace strandcast
