#include "server/report/recommend.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "common/log/progress.h"
#include "common/scene/scene_file.h"
#include "server/report/report_commands.h"
#include "server/report/report_executor.h"
#include "server/report/report_options.h"
#include "server/scene/scene_content.h"
#include "server/scene/step_builder.h"

namespace strandcast {
namespace {

constexpr double kEffortFactors[] = {0.25, 0.5, 1.0, 2.0, 4.0};
constexpr uint32_t kSubsteps[] = {1, 2, 4, 8};
// Steps of eight substeps each.
constexpr int kWarmUpSteps = 1;
constexpr int kTimedSteps = 2;
// As a quick work-precision.
constexpr double kMotionS = 2.0;
constexpr uint32_t kMotionStrands = 8;
constexpr uint32_t kReferenceVertices = 64;
constexpr double kReferenceRateHz = 1920.0;
constexpr size_t kShownCandidates = 6;

/// The rate at which errors are measured: a multiple of the motion set's samples.
double measured_rate_hz(const SceneDesc& scene) {
  constexpr double kSamplesHz = 1.0 / MotionSet::kSampleS;
  return kSamplesHz * std::max(1.0, std::round(scene.step_rate_hz / kSamplesHz));
}

/// What the row is run with: hair of real constants where it has them, else as it ships. The groom as loaded
/// is the shape at rest.
Result<SolverParameters> scene_parameters(const RunSetting& setting, const MotionSet& motion,
                                          double length_m) {
  RunPhysics physics = motion.physics();
  physics.length_m = length_m;
  physics.given["sag_free"] = 1.0;
  return run_parameters(setting, physics);
}

/// The motion set's hair that turns as much on its way as the groom's strands in the mean: not at all, by its
/// arc, or more.
MotionHair nearest_hair(const Groom& groom) {
  constexpr double kStraightRad = 0.5;
  constexpr double kCurledRad = 4.0;
  double turn_rad = 0.0;
  for (uint32_t s = 0; s < groom.strand_count(); ++s) {
    const auto* point = groom.rest_position_m.data() + groom.offset[s];
    for (uint32_t i = 2; i < groom.vertex_count(s); ++i) {
      const glm::dvec3 before(point[i - 1] - point[i - 2]);
      const glm::dvec3 after(point[i] - point[i - 1]);
      turn_rad +=
          std::atan2(glm::length(glm::cross(before, after)), glm::dot(before, after)) / groom.strand_count();
    }
  }
  if (turn_rad < kStraightRad) return MotionHair::Straight;
  return turn_rad < kCurledRad ? MotionHair::Styled : MotionHair::Curled;
}

std::string scene_lines(const RunSetting& setting, const SolverParameters& parameters) {
  std::string text = fmt::format("solver {{\n  name: \"{}\"\n", setting.row->name);
  for (const SolverParameterInfo& info : setting.row->parameters) {
    const double value = parameters.at(info.name);
    if (value != info.default_value || info.name == setting.row->effort_parameter)
      text += fmt::format("  parameters {{ key: \"{}\" value: {} }}\n", info.name, value);
  }
  return text + fmt::format("}}\nsubsteps: {}\n", setting.substeps);
}

class SceneMeasurement {
 public:
  SceneMeasurement(const SceneDesc& scene, const SceneContent& content, const MotionSet& motion,
                   Executor& executor)
      : scene_(scene), content_(content), motion_(motion), executor_(executor), workbench_{&executor} {
    for (uint32_t s = 0; s < content.groom.strand_count(); ++s)
      length_m_ += static_cast<double>(content.groom.length_m(s)) / content.groom.strand_count();
  }

  double length_m() const { return length_m_; }
  SimDevice device() const { return executor_.info().device; }
  uint32_t vertex_count() const { return content_.groom.uniform_vertex_count(); }

  /// Milliseconds per substep on the scene's own strands, colliders and wind: the best of several.
  Result<double> substep_ms(const RunSetting& setting) const {
    ASSIGN_OR_RETURN(const SolverParameters parameters, scene_parameters(setting, motion_, length_m_));
    SceneDesc scene = scene_;
    scene.substeps = setting.substeps;
    const SceneFeatures features = analyse(scene, {});
    ASSIGN_OR_RETURN(auto solver, setting.row->make(parameters, {&executor_, features}));
    RETURN_IF_ERROR(solver->load(content_.groom, glm::dquat(1.0, 0.0, 0.0, 0.0)));
    StepBuilder builder(scene, content_.colliders);
    double best_ms = std::numeric_limits<double>::infinity();
    for (int step = 1; step <= kWarmUpSteps + kTimedSteps; ++step) {
      const double time_s = step / scene.step_rate_hz;
      InputFrame frame;
      frame.has_motion = true;
      frame.world_from_head = motion_.head_at(time_s);
      for (const StepInput& substep : builder.build(frame, features, time_s).substeps) {
        const double ms = timed_ms(executor_, [&] { solver->substep(substep); });
        if (step > kWarmUpSteps) best_ms = std::min(best_ms, ms);
      }
    }
    return best_ms;
  }

  Result<double> error(const RunSetting& setting, const Trajectory& reference) const {
    ASSIGN_OR_RETURN(const Trajectory run, motion_.run(workbench_, setting));
    return relative_rms(run, reference);
  }

 private:
  const SceneDesc& scene_;
  const SceneContent& content_;
  const MotionSet& motion_;
  Executor& executor_;
  Workbench workbench_;
  double length_m_ = 0.0;
};

Result<std::vector<const SolverRow*>> rows_to_choose_from(const std::vector<std::string>& names) {
  std::vector<const SolverRow*> rows;
  for (const std::string& name : names) {
    ASSIGN_OR_RETURN(const SolverRow* row, find_solver(name));
    rows.push_back(row);
  }
  if (!names.empty()) return rows;
  for (const SolverRow& row : solver_table()) rows.push_back(&row);
  return rows;
}

/// Every setting of a row with its time on every executor; those that the row or its stable range refuses are
/// left out.
void add_timed_candidates(const std::vector<SceneMeasurement>& measurements, RunSetting setting,
                          std::vector<Candidate>& candidates) {
  // A substep takes the same time whatever its length; the shortest is the likeliest to be stable.
  setting.substeps = kSubsteps[std::size(kSubsteps) - 1];
  for (const SceneMeasurement& measurement : measurements) {
    const auto ms = measurement.substep_ms(setting);
    if (!ms) continue;
    Candidate candidate{setting, measurement.device(), 0.0, std::numeric_limits<double>::infinity()};
    for (const uint32_t substeps : kSubsteps) {
      candidate.setting.substeps = substeps;
      candidate.ms_per_step = *ms * substeps;
      candidates.push_back(candidate);
    }
  }
}

/// The fastest first.
std::vector<Candidate> timed_candidates(const std::vector<SceneMeasurement>& measurements,
                                        const std::vector<const SolverRow*>& rows, double rate_hz) {
  Progress progress({"recommend"});
  std::vector<Candidate> candidates;
  const std::vector<double> factors(std::begin(kEffortFactors), std::end(kEffortFactors));
  for (const SolverRow* row : rows)
    progress.expect(static_cast<uint32_t>(effort_values(*row, factors).size()),
                    static_cast<double>(effort_values(*row, factors).size()));
  const uint32_t vertex_count = measurements.front().vertex_count();
  for (const SolverRow* row : rows) {
    for (const double effort : effort_values(*row, factors)) {
      const RunSetting setting{
          row, row->as_hair ? Material::Hair : Material::AsShipped, vertex_count, rate_hz, 1, effort};
      progress.begin_run("time of " + to_string(setting));
      add_timed_candidates(measurements, setting, candidates);
      progress.end_run(1.0);
    }
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.ms_per_step < b.ms_per_step; });
  return candidates;
}

/// Errors of candidates that fit; of a setting on several executors by the fastest, since float differs by
/// less than anybody sees. The most exact first.
void add_errors(const std::vector<SceneMeasurement>& measurements, const Trajectory& reference,
                std::vector<Candidate>& fitting) {
  Progress progress({"recommend"});
  progress.expect(static_cast<uint32_t>(fitting.size()), static_cast<double>(fitting.size()));
  std::map<std::string, double> errors;
  for (Candidate& candidate : fitting) {
    const std::string words = to_string(candidate.setting);
    progress.begin_run("error of " + words);
    const auto [known, is_new] = errors.try_emplace(words, candidate.error);
    const auto own = std::find_if(
        measurements.begin(), measurements.end(),
        [&](const SceneMeasurement& measurement) { return measurement.device() == candidate.device; });
    // A step outside the model's stable range stays at an unbounded error.
    if (is_new)
      if (const auto error = own->error(candidate.setting, reference)) known->second = *error;
    candidate.error = known->second;
    progress.end_run(1.0);
  }
  std::stable_sort(fitting.begin(), fitting.end(),
                   [](const Candidate& a, const Candidate& b) { return a.error < b.error; });
}

std::string on_what(const Candidate& candidate) {
  return fmt::format("{} on {}", to_string(candidate.setting), to_string(candidate.device));
}

Error nothing_fits(const std::vector<Candidate>& candidates, const Groom& groom, double budget_ms) {
  if (candidates.empty())
    return make_error(ErrorCode::Unsupported, "no strand model can be run for this scene");
  const Candidate& fastest = candidates.front();
  return make_error(
      ErrorCode::LimitExceeded,
      "nothing fits {:g} ms per step: the fastest, {} on {}, takes {:.3g} ms for {} strands of {} vertices; "
      "give a larger budget, or about {:.0f} strands",
      budget_ms, fastest.setting.row->name, to_string(fastest.device), fastest.ms_per_step,
      groom.strand_count(), groom.uniform_vertex_count(),
      std::floor(groom.strand_count() * budget_ms / fastest.ms_per_step));
}

}  // namespace

Result<Recommendation> recommend(const SceneDesc& scene, const RecommendOptions& options) {
  if (!(options.budget_ms > 0.0))
    return make_error(ErrorCode::BadInput, "--budget-ms is {:g} (allowed: above 0)", options.budget_ms);
  ASSIGN_OR_RETURN(const auto rows, rows_to_choose_from(options.solvers));
  ASSIGN_OR_RETURN(const SceneContent content, load_scene_content(scene));
  const MotionHair hair = nearest_hair(content.groom);
  ASSIGN_OR_RETURN(const MotionSet motion, MotionSet::make({{}, kMotionS, kMotionStrands, hair}));
  ASSIGN_OR_RETURN(const auto executors, open_report_executors(options.device));
  if (executors.empty())
    return make_error(ErrorCode::BadInput, "--gl-device {} leaves nothing to measure on", kNoDevice);
  Recommendation result;
  std::vector<SceneMeasurement> measurements;
  for (const auto& executor : executors) {
    result.executors.push_back(executor->info());
    measurements.emplace_back(scene, content, motion, *executor);
  }
  const double rate_hz = measured_rate_hz(scene);

  std::vector<Candidate> candidates = timed_candidates(measurements, rows, rate_hz);
  result.hair = hair;
  result.strand_count = content.groom.strand_count();
  result.vertex_count = content.groom.uniform_vertex_count();
  const auto beyond = std::find_if(candidates.begin(), candidates.end(), [&](const Candidate& candidate) {
    return candidate.ms_per_step > options.budget_ms;
  });
  if (beyond != candidates.end()) result.next = *beyond;
  result.fitting.assign(candidates.begin(), beyond);
  if (result.fitting.empty()) return nothing_fits(candidates, content.groom, options.budget_ms);

  ASSIGN_OR_RETURN(const Trajectory reference, run_rod(motion, kReferenceVertices, kReferenceRateHz));
  add_errors(measurements, reference, result.fitting);
  if (!std::isfinite(result.fitting.front().error))
    return nothing_fits(candidates, content.groom, options.budget_ms);
  const RunSetting& best = result.fitting.front().setting;
  ASSIGN_OR_RETURN(const SolverParameters parameters,
                   scene_parameters(best, motion, measurements.front().length_m()));
  result.scene_lines = scene_lines(best, parameters);
  return result;
}

std::string recommendation_text(const Recommendation& recommendation, const SceneDesc& scene,
                                double budget_ms) {
  const Candidate& best = recommendation.fitting.front();
  std::vector<std::string> names;
  for (const ExecutorInfo& executor : recommendation.executors) names.push_back(executor.name);
  std::string text = fmt::format(
      "Scene '{}': {} strands of {} vertices, {:g} steps per second, on {}.\n\n{:<58} {:>6} {:>9} {:>9}\n",
      scene.name, recommendation.strand_count, recommendation.vertex_count, scene.step_rate_hz,
      fmt::join(names, " and on "), "setting", "on", "ms/step", "error");
  for (size_t i = 0; i < std::min(kShownCandidates, recommendation.fitting.size()); ++i) {
    const Candidate& candidate = recommendation.fitting[i];
    text += fmt::format("{:<58} {:>6} {:>9.3g} {:>8.3g} %\n", to_string(candidate.setting),
                        to_string(candidate.device), candidate.ms_per_step, 100.0 * candidate.error);
  }
  text += fmt::format(
      "\nTake {}: of the {} settings that fit {:g} ms per step it is the most exact, {:.3g} % of the "
      "strand's "
      "length from a converged rod, and takes {:.3g} ms of simulation per step. Times are of the scene's own "
      "strands; errors are not, but of {} hair of {:g} m on the built-in head motion, without colliders.\n",
      on_what(best), recommendation.fitting.size(), budget_ms, 100.0 * best.error, best.ms_per_step,
      to_string(recommendation.hair), MotionSet::kLengthM);
  if (recommendation.next.setting.row != nullptr) {
    text += fmt::format("The first that does not fit is {} with {:.3g} ms.\n", on_what(recommendation.next),
                        recommendation.next.ms_per_step);
  }
  text += "\nFor the scene file:\n\n" + recommendation.scene_lines;
  if (recommendation.executors.size() > 1)
    text += fmt::format("\nand strandcast-server --sim-device {}\n", to_string(best.device));
  return text;
}

void declare_recommend(CLI::App& command, RecommendOptions& options) {
  command.add_option("--scene", options.scene_path, "scene file; default: the built-in scene");
  command.add_option("--set", options.overrides, "path=value: override a field of the scene; repeatable")
      ->expected(1)
      ->take_all();
  command.add_option("--budget-ms", options.budget_ms, "milliseconds of simulation per step")->required();
  command.add_option("--solver", options.solvers, "choose from this one; repeatable")
      ->expected(1)
      ->take_all();
  add_sim_device_options(command, options.device, {true});
}

void add_recommend_command(CLI::App& app, ReportAction& action) {
  const auto options = std::make_shared<RecommendOptions>();
  CLI::App* command =
      app.add_subcommand("recommend", "the most exact strand model for a scene within a time budget");
  declare_recommend(*command, *options);
  command->callback([options, &action] {
    action = [options]() -> Status {
      ASSIGN_OR_RETURN(const SceneDesc scene, options->scene_path.empty()
                                                  ? built_in_scene_with(options->overrides)
                                                  : load_scene(options->scene_path, options->overrides));
      ASSIGN_OR_RETURN(const Recommendation recommendation, recommend(scene, *options));
      fmt::print("{}", recommendation_text(recommendation, scene, options->budget_ms));
      return {};
    };
  });
}

}  // namespace strandcast
