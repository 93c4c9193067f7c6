// Prints what hair on hair and air take beside the rod alone, as CSV: processor time of a step of the whole
// process, in turns in the same run, while the head says no in the scene's own wind. The ratio is the median
// over the turns. usage: company_bench [--strands N] [--vertices N] [--rounds N] [--wind no]
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "common/base/check.h"
#include "common/base/quantile.h"
#include "common/scene/features.h"
#include "common/scene/scene_file.h"
#include "server/scene/scene_content.h"
#include "server/scene/step_builder.h"
#include "server/sim/executor/lanes_executor.h"
#include "server/sim/solver_registry.h"

namespace strandcast {
namespace {

constexpr int kStepsOfRound = 5;
constexpr int kFirstRounds = 4;  // not measured: the hair is at rest, and memory is new

struct Options {
  std::string strands = "2000";
  std::string vertices = "16";
  int rounds = 40;
  bool has_wind = true;
};

double cpu_ms() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

/// A scene's solver under a head that says no.
class Company {
 public:
  Company(std::string name, const SceneDesc& scene, const SceneContent& content, Executor& executor)
      : name_(std::move(name)),
        rate_hz_(scene.step_rate_hz),
        features_(analyse(scene, {})),
        builder_(scene, content.colliders) {
    const SolverRow& row = *find_solver(scene.solver.name).value();
    SolverContext context{&executor, features_};
    context.groom_gravity_in_head_mps2 = scene.gravity_mps2;
    context.volume = scene.volume;
    solver_ = row.make(complete_parameters(row, scene.solver.parameters).value(), context).value();
    CHECK(solver_->load(content.groom, glm::dquat(1.0, 0.0, 0.0, 0.0)).ok());
  }

  /// Mean of a round, ms.
  void go() {
    const double begin_ms = cpu_ms();
    for (int i = 0; i < kStepsOfRound; ++i) {
      const double time_s = static_cast<double>(++tick_) / rate_hz_;
      constexpr double kYawRad = 0.96, kPerS = 2.2;
      InputFrame input;
      input.has_motion = true;
      input.is_motion_stale = false;
      input.world_from_head.rotation = glm::angleAxis(
          std::min(1.0, 2.0 * time_s) * kYawRad * std::sin(2.0 * std::numbers::pi * kPerS * time_s),
          glm::dvec3(0.0, 1.0, 0.0));
      const SceneStep& step = builder_.build(input, features_, time_s);
      for (const StepInput& substep : step.substeps) solver_->substep(substep);
    }
    step_ms_.push_back((cpu_ms() - begin_ms) / kStepsOfRound);
  }
  const std::string& name() const { return name_; }
  const std::vector<double>& step_ms() const { return step_ms_; }

 private:
  std::string name_;
  double rate_hz_;
  SceneFeatures features_;
  StepBuilder builder_;
  std::unique_ptr<Solver> solver_;
  uint64_t tick_ = 0;
  std::vector<double> step_ms_;
};

int run(const Options& options) {
  // The field would take as long for each.
  const auto read = built_in_scene_with({"quality=full", "head.collider=spheres",
                                         "groom.procedural.strand_count=" + options.strands,
                                         "groom.procedural.vertex_count=" + options.vertices});
  if (!read) {
    fmt::print(stderr, "{}\n", read.error().to_string());
    return 2;
  }
  SceneDesc full = *read;
  if (!options.has_wind) full.wind = {};
  SceneDesc contact = full;
  contact.volume.air.acts = false;
  SceneDesc alone = contact;
  alone.volume = {};
  const SceneContent content = load_scene_content(full).value();
  const auto executor = make_lanes_executor().value();
  std::vector<std::unique_ptr<Company>> rows;
  rows.push_back(std::make_unique<Company>("rod alone", alone, content, *executor));
  rows.push_back(std::make_unique<Company>("rod and contact", contact, content, *executor));
  rows.push_back(std::make_unique<Company>("rod, contact and air", full, content, *executor));
  for (int round = 0; round < kFirstRounds + options.rounds; ++round)
    for (const auto& row : rows) row->go();
  fmt::print("# {} strands of {}, {}\nrow,cpu ms of a step,over the rod alone\n", options.strands,
             options.vertices, executor->info().name);
  for (const auto& row : rows) {
    std::vector<double> ms, ratio;
    for (size_t i = kFirstRounds; i < row->step_ms().size(); ++i) {
      ms.push_back(row->step_ms()[i]);
      ratio.push_back(row->step_ms()[i] / rows.front()->step_ms()[i]);
    }
    fmt::print("{},{:.3f},{:.2f}\n", row->name(), median(ms), median(ratio));
  }
  return 0;
}

}  // namespace
}  // namespace strandcast

int main(int argc, char** argv) {
  strandcast::Options options;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string name = argv[i];
    if (name == "--strands") options.strands = argv[i + 1];
    if (name == "--vertices") options.vertices = argv[i + 1];
    if (name == "--rounds") options.rounds = std::max(1, std::atoi(argv[i + 1]));
    if (name == "--wind") options.has_wind = std::string(argv[i + 1]) != "no";
  }
  return strandcast::run(options);
}
