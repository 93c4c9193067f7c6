// Air that drags hair less along its length than across: by the equation, on every executor, and without ever
// feeding the motion of any model.
#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <random>

#include "server/report/crowded_hair.h"
#include "server/sim/executor/lanes_executor.h"
#include "server/sim/oriented_drag.h"
#include "server/sim/strand_state.h"
#include "tests/support/sim_devices.h"

namespace strandcast::oriented_drag_test {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

class OrientedDragOn : public testing::TestWithParam<SimDevice> {
 protected:
  Executor& executor() { return executors_.on(GetParam()); }
  static SimExecutors executors_;
};
SimExecutors OrientedDragOn::executors_;

// v - h c (1 - share) t (t . (wind - (v - v_head))), t through the neighbours, in double.
TEST_P(OrientedDragOn, GivesBackWhatGoesAlong) {
  const Groom groom = make_tuft(67, 12, 0.2f, 3);
  StrandState strands(executor());
  const glm::dquat rotation = glm::normalize(glm::dquat(0.8, 0.1, -0.5, 0.2));
  ASSERT_TRUE(strands.load(groom, rotation));
  SolverState state;
  strands.read(state);
  const StrandLayout& layout = strands.layout();
  std::mt19937 random(4);
  std::normal_distribution<float> normal;
  for (size_t i = layout.strand_count; i < state.position_m.size(); ++i) {
    state.position_m[i] += 0.004f * glm::vec3(normal(random), normal(random), normal(random));
    state.velocity_mps[i] = glm::vec3(normal(random), normal(random), normal(random));
  }
  const size_t broken = layout.index(5, 7);
  state.velocity_mps[broken].x = kNan;
  strands.write(state);
  StepInput input;
  input.world_from_head_rotation = rotation;
  input.head_shift_m = glm::dvec3(0.3, -0.1, 0.2) * input.h_s;
  input.wind_mps = {2.0, 0.5, -1.0};
  StrandParameters parameters;
  parameters.air_drag_per_s = 7.0;
  parameters.max_speed_mps = 100.0;
  const StepBlock step = make_step_block(input, parameters, layout.counts(), strands.head());
  constexpr double kShare = 0.3;
  SceneFeatures features;
  features.has_wind = true;
  auto drag = OrientedDrag::make(executor(), features, layout, nullptr, kShare);
  ASSERT_TRUE(drag) << drag.error().to_string();
  drag->run(step, strands.planes(), nullptr);
  SolverState after;
  strands.read(after);

  const glm::dvec3 head_mps = input.head_shift_m / input.h_s;
  double changed = 0.0;
  for (uint32_t strand = 0; strand < layout.strand_count; ++strand)
    for (uint32_t vertex = 0; vertex < layout.vertex_count; ++vertex) {
      const size_t at = layout.index(vertex, strand);
      if (at == broken) continue;  // is for others to mend
      const glm::dvec3 before(state.velocity_mps[at]);
      glm::dvec3 expected = before;
      if (vertex > 0) {
        const size_t next = vertex + 1 < layout.vertex_count ? at + layout.strand_count : at;
        const glm::dvec3 along = glm::normalize(glm::dvec3(state.position_m[next]) -
                                                glm::dvec3(state.position_m[at - layout.strand_count]));
        // The wind is told as the head feels it.
        const glm::dvec3 wind = input.wind_mps - head_mps - (before - head_mps);
        expected -= input.h_s * parameters.air_drag_per_s * (1.0 - kShare) * glm::dot(wind, along) * along;
        changed = std::max(changed, glm::distance(before, expected));
      }
      EXPECT_LT(glm::distance(glm::dvec3(after.velocity_mps[at]), expected), 2e-6) << vertex << ' ' << strand;
      EXPECT_EQ(after.position_m[at], state.position_m[at]);
    }
  EXPECT_GT(changed, 0.05);
}
INSTANTIATE_TEST_SUITE_P(Devices, OrientedDragOn, testing::ValuesIn(sim_devices()), name_of_device);

SceneDesc windy_scene(const SolverRow& row, float along_share, const glm::vec3& wind_mps) {
  SceneDesc scene;
  scene.solver.name = row.name;
  for (const SolverParameterInfo& info : row.parameters)
    if (info.name == "style_stiffness_per_s2") scene.solver.parameters[info.name] = 0.0;
  scene.wind.mean_mps = wind_mps;
  scene.wind.along_share = along_share;
  scene.follicle_limit_deg = 180.0;
  return scene;
}

struct Blown {
  std::vector<glm::vec3> shaken_m;  // all vertices, when the head has moved
  glm::dvec3 mean_m{0.0};           // of all vertices, when it has stood still
  double speed_mps = 0.0;           // root mean square then
};

Blown blown(const SceneDesc& scene) {
  SceneContent content;
  content.groom = make_tuft(30, 16, 0.2f, 2);
  auto executor = std::move(make_lanes_executor()).value();
  HairRun run = HairRun::make(*executor, scene, content).value();
  const auto steps_of = [&](double seconds) { return std::lround(seconds * scene.step_rate_hz); };
  Blown result;
  for (int64_t i = 0; i < steps_of(1.5); ++i) run.step(shaken_head(run.time_s()));
  const Pose still = shaken_head(run.time_s());
  result.shaken_m = run.position_in_head_m();
  for (int64_t i = 0; i < steps_of(12.0); ++i) run.step(still);
  double squared = 0.0;
  for (int64_t i = 0; i < steps_of(1.0); ++i) {
    run.step(still);
    for (const glm::vec3& velocity : run.velocity_in_head_mps())
      squared += static_cast<double>(glm::dot(velocity, velocity));
  }
  const auto count = static_cast<double>(run.position_in_head_m().size());
  result.speed_mps = std::sqrt(squared / (count * static_cast<double>(steps_of(1.0))));
  for (const glm::vec3& point : run.position_in_head_m()) result.mean_m += glm::dvec3(point) / count;
  return result;
}

double rms_between_m(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b) {
  double squared = 0.0;
  for (size_t i = 0; i < a.size(); ++i) squared += static_cast<double>(glm::dot(a[i] - b[i], a[i] - b[i]));
  return std::sqrt(squared / static_cast<double>(a.size()));
}

class BlownHair : public testing::TestWithParam<std::string> {};

// How a straight strand leans in a wind follows from what is across it alone: gravity and drag along only
// pull. So hair comes to rest where it did, as quietly, whatever the share; on the way there it moves
// otherwise.
TEST_P(BlownHair, LeansAsBeforeAndMovesOtherwise) {
  const SolverRow& row = *find_solver(GetParam()).value();
  const glm::vec3 wind_mps(1.0f, 0.0f, 0.0f);
  const Blown alike = blown(windy_scene(row, 1.0f, wind_mps));
  // One row never quite rests in a wind, and less so the less drags it.
  const double more = row.name == "tractrix_emulation" ? 4.0 : 2.0;
  for (const float share : {0.5f, 0.0f}) {
    SCOPED_TRACE(share);
    const Blown thin = blown(windy_scene(row, share, wind_mps));
    EXPECT_LT(glm::distance(alike.mean_m, thin.mean_m), 1e-3);
    EXPECT_LT(thin.speed_mps, std::max(more * alike.speed_mps, 1e-3)) << alike.speed_mps;
    EXPECT_GT(rms_between_m(alike.shaken_m, thin.shaken_m), 1e-5);
  }
}
std::vector<std::string> rows_with_drag() {
  std::vector<std::string> names;
  for (const SolverRow& row : solver_table()) {
    const bool has_drag =
        std::any_of(row.parameters.begin(), row.parameters.end(),
                    [](const SolverParameterInfo& info) { return info.name == "air_drag_per_s"; });
    if (row.has_kernel && has_drag && row.comes_to_rest && row.bears_volume) names.push_back(row.name);
  }
  return names;
}
INSTANTIATE_TEST_SUITE_P(Rows, BlownHair, testing::ValuesIn(rows_with_drag()),
                         [](const auto& row) { return row.param; });

}  // namespace
}  // namespace strandcast::oriented_drag_test
