#include "server/report/work_precision.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <future>
#include <map>
#include <memory>
#include <optional>

#include "common/base/profile.h"
#include "common/log/progress.h"
#include "server/report/report_executor.h"
#include "server/report/run_timer.h"

namespace strandcast {
namespace {

// A step's own cost beside that of its vertices, for the estimate of the time left.
constexpr double kVerticesPerStep = 400.0;

double cost_of(const RunSetting& setting, double simulated_s) {
  const double effort = std::isnan(setting.effort) ? 1.0 : setting.effort;
  return simulated_s * setting.rate_hz * setting.substeps *
         (1.0 + setting.vertex_count * effort / kVerticesPerStep);
}

/// What the rows without constants of hair are run with on a moving head: as they ship, and, where the hair
/// has no shape of its own, as chains.
std::vector<Material> materials_of(const SolverRow& row, MotionHair hair) {
  if (row.as_hair) return {Material::Hair};
  if (hair != MotionHair::Straight) return {Material::AsShipped};
  return {Material::Limp, Material::AsShipped};
}

/// A row with many vertices and small steps; a few of the strands are enough for it.
struct Refined {
  Trajectory trajectory;
  double rate_hz = 0.0;
};
constexpr uint32_t kRefinedStrands = 2;

/// The trajectories that runs are compared with. Double precision, so any thread.
struct References {
  Trajectory rod;
  WorkReport::Converged converged;
  std::map<std::pair<std::string, Material>, Refined> refined;  // none where a row cannot be refined
};

/// Seconds that the whole motion takes in double at this setting, from a few steps.
Result<double> expected_run_s(const MotionSet& motion, const RunSetting& setting) {
  constexpr int kTriedSteps = 4;
  ASSIGN_OR_RETURN(StrandRun run, StrandRun::make({}, setting, motion.physics(),
                                                  motion.groom(setting.vertex_count, kRefinedStrands)));
  const std::vector<StepInput> inputs = motion.inputs(setting, kTriedSteps);
  const int64_t begin_ns = now_ns();
  for (const StepInput& input : inputs) run.substep(input);
  const double step_s = static_cast<double>(now_ns() - begin_ns) * 1e-9 / kTriedSteps;
  return step_s * motion.duration_s() * setting.rate_hz;
}

/// The row on its own with many vertices and small steps; steps twice as long while it would take too long.
Result<Refined> run_refined(const MotionSet& motion, const WorkGrid& grid, const SolverRow& row,
                            Material material) {
  constexpr double kCoarsestHz = 240.0;
  RunSetting setting{&row, material, grid.refined_vertices, grid.refined_rate_hz};
  setting.effort = effort_values(row, {grid.refined_effort_factor}).front();
  setting.is_reference = true;
  ASSIGN_OR_RETURN(double expected_s, expected_run_s(motion, setting));
  while (expected_s > grid.longest_run_s && setting.rate_hz > kCoarsestHz) {
    setting.rate_hz /= 2.0;
    expected_s /= 2.0;
  }
  if (expected_s > grid.longest_run_s)
    return make_error(ErrorCode::LimitExceeded, "the refined run would take {:.0f} s", expected_s);
  ASSIGN_OR_RETURN(Trajectory trajectory, motion.run({}, setting, kRefinedStrands));
  return Refined{std::move(trajectory), setting.rate_hz};
}

Result<References> make_references(const MotionSet& motion, const WorkGrid& grid,
                                   const std::vector<const SolverRow*>& rows) {
  References references;
  auto halved = std::async(std::launch::async, [&] {
    return run_rod(motion, grid.reference_vertices, 2.0 * grid.reference_rate_hz);
  });
  auto rod = run_rod(motion, grid.reference_vertices, grid.reference_rate_hz);
  auto coarse = run_rod(motion, grid.reference_vertices / 2, grid.reference_rate_hz);
  auto check = run_in_double(motion, kCheckModel, grid.reference_vertices, grid.check_rate_hz);
  auto fine = halved.get();
  for (const auto* result : {&rod, &coarse, &check, &fine})
    if (!*result) return result->error();
  references.converged = {motion.hair(), relative_rms(*rod, *fine), relative_rms(*coarse, *rod),
                          relative_rms(*check, *rod)};
  references.rod = std::move(rod).value();
  for (const SolverRow* row : rows) {
    for (const Material material : materials_of(*row, motion.hair())) {
      if (auto refined = run_refined(motion, grid, *row, material))
        references.refined[{row->name, material}] = std::move(refined).value();
    }
  }
  return references;
}

class Measurement {
 public:
  /// `motions`: of every hair, straight first or alone.
  /// `benches` outlive it; at least one.
  Measurement(const WorkGrid& grid, const std::vector<MotionSet>& motions, std::vector<const SolverRow*> rows,
              const std::vector<Workbench>& benches)
      : grid_(grid), rows_(std::move(rows)), benches_(benches), progress_({"work-precision"}) {
    for (const MotionSet& motion : motions) {
      HairSet set{&motion};
      for (const Workbench& bench : benches_) set.timers.emplace_back(bench, motion);
      sets_.push_back(std::move(set));
    }
  }

  // Times first, while nothing else runs; then tests here and references on another thread; then the motion.
  Status run(WorkReport& report) {
    plan();
    for (HairSet& set : sets_)
      for (const Run& run : set.runs) time_run(set, run);
    auto references = std::async(std::launch::async, [this]() -> Result<std::vector<References>> {
      std::vector<References> all;
      for (const HairSet& set : sets_) {
        ASSIGN_OR_RETURN(References one, make_references(*set.motion, grid_, rows_));
        all.push_back(std::move(one));
      }
      return all;
    });
    for (const Planned& planned : analytic_runs_) report.records.push_back(run_analytic(planned));
    progress_.begin_run("converged reference");
    const auto converged = references.get();
    if (!converged) return converged.error();
    progress_.end_run(0.0);
    for (size_t i = 0; i < sets_.size(); ++i) {
      report.converged.push_back((*converged)[i].converged);
      for (const Run& run : sets_[i].runs)
        report.records.push_back(run_motion(sets_[i], run, (*converged)[i]));
    }
    const HairSet& first = sets_.front();
    if (!first.runs.empty())
      report.timed_strands = first.timers.front().strand_count(first.runs.front().setting);
    return {};
  }

 private:
  struct Run {
    RunSetting setting;
    size_t bench = 0;
  };
  struct Planned {
    const AnalyticTest* test = nullptr;
    Run run;
  };
  struct HairSet {
    const MotionSet* motion = nullptr;
    std::vector<RunTimer> timers = {};  // by bench
    std::vector<Run> runs = {};
    std::map<std::string, Trajectory> exact = {};  // of runs on more than one bench, by setting
  };

  /// The setting on every executor, one after the other, so that what else the machine does disturbs all
  /// alike; a row without a kernel runs once.
  std::vector<Run> on_each_bench(const RunSetting& setting) const {
    std::vector<Run> runs;
    for (size_t bench = 0; bench < benches_.size(); ++bench)
      if (bench == 0 || benches_[bench].runs_kernel(setting)) runs.push_back({setting, bench});
    return runs;
  }

  void plan() {
    for (const SolverRow* row : rows_) {
      for (HairSet& set : sets_)
        for (const Material material : materials_of(*row, set.motion->hair()))
          plan_motion(set, *row, material);
      for (const AnalyticTest& test : analytic_tests()) {
        if (has_physics(*row, test) && (test.is_quick || grid_.has_every_effort)) plan_analytic(*row, test);
      }
    }
    uint32_t timed_runs = 0;
    for (const HairSet& set : sets_) {
      for (const Run& run : set.runs) progress_.expect(1, cost_of(run.setting, grid_.motion_s));
      timed_runs += static_cast<uint32_t>(set.runs.size());
    }
    for (const Planned& planned : analytic_runs_)
      progress_.expect(1, cost_of(planned.run.setting, planned.test->simulated_s));
    progress_.expect(1 + timed_runs, 0.0);
  }

  void plan_motion(HairSet& set, const SolverRow& row, Material material) {
    for (const double effort : effort_values(row, grid_.effort_factors))
      for (const uint32_t vertex_count : grid_.vertices)
        for (const double rate_hz : grid_.rates_hz)
          for (const uint32_t substeps : grid_.substeps)
            for (const Run& run : on_each_bench({&row, material, vertex_count, rate_hz, substeps, effort}))
              set.runs.push_back(run);
  }

  void plan_analytic(const SolverRow& row, const AnalyticTest& test) {
    const std::vector<double> factors =
        grid_.has_every_effort ? grid_.effort_factors : std::vector<double>{1.0};
    const std::vector<uint32_t> vertices = test.fixed_vertex_count > 0
                                               ? std::vector<uint32_t>{test.fixed_vertex_count}
                                               : grid_.analytic_vertices;
    const std::vector<double> rates =
        test.fixed_rate_hz > 0.0 ? std::vector<double>{test.fixed_rate_hz} : grid_.analytic_rates_hz;
    for (const double effort : effort_values(row, factors))
      for (const uint32_t vertex_count : vertices)
        for (const double rate_hz : rates)
          for (const Run& run : on_each_bench({&row, test.material, vertex_count, rate_hz, 1, effort}))
            analytic_runs_.push_back({&test, run});
  }

  WorkRecord record_for(const std::string& test, const Run& run) const {
    return {test, run.setting, benches_[run.bench].name_of(run.setting)};
  }

  /// Not empty when a row that only runs in double would take too long for it.
  std::string too_slow(HairSet& set, const Run& run, double simulated_s, uint32_t strand_count) {
    const RunSetting& setting = run.setting;
    if (benches_[run.bench].runs_kernel(setting)) return "";
    const auto time = set.timers[run.bench].time(setting);
    if (!time) return "";
    const double expected_s =
        time->best_us * 1e-6 * strand_count * simulated_s * setting.rate_hz * setting.substeps;
    return expected_s > grid_.longest_run_s ? fmt::format("left out: {:.0f} s", expected_s) : "";
  }

  std::string words_of(const Run& run) const {
    return fmt::format("{}, {}", to_string(run.setting), benches_[run.bench].name_of(run.setting));
  }

  void time_run(HairSet& set, const Run& run) {
    progress_.begin_run("time of " + words_of(run));
    (void)set.timers[run.bench].time(run.setting);  // asked for again, with its error, when it is recorded
    progress_.end_run(0.0);
  }

  void add_time(HairSet& set, const Run& run, WorkRecord& record) {
    if (const auto time = set.timers[run.bench].time(run.setting)) strandcast::add_time(record, *time);
  }

  WorkRecord run_analytic(const Planned& planned) {
    const RunSetting& setting = planned.run.setting;
    progress_.begin_run(planned.test->name + ", " + words_of(planned.run));
    WorkRecord record = record_for(planned.test->name, planned.run);
    record.result.note = too_slow(sets_.front(), planned.run, planned.test->simulated_s, 1);
    if (record.result.note.empty()) record.result = planned.test->run(benches_[planned.run.bench], setting);
    const auto& sizes = grid_.vertices;
    if (std::find(sizes.begin(), sizes.end(), setting.vertex_count) != sizes.end())
      add_time(sets_.front(), planned.run, record);
    progress_.end_run(cost_of(setting, planned.test->simulated_s));
    return record;
  }

  /// The setting in double; run once, whatever it is compared with.
  Result<Trajectory> in_double(HairSet& set, RunSetting setting) {
    const std::string key = to_string(setting);
    if (const auto known = set.exact.find(key); known != set.exact.end()) return known->second;
    setting.is_reference = true;
    ASSIGN_OR_RETURN(Trajectory trajectory, set.motion->run({}, setting));
    if (benches_.size() > 1) set.exact[key] = trajectory;
    return trajectory;
  }

  WorkRecord run_motion(HairSet& set, const Run& planned, const References& references) {
    const MotionSet& motion = *set.motion;
    const RunSetting& setting = planned.setting;
    const Workbench& bench = benches_[planned.bench];
    WorkRecord record = record_for(motion_test(motion.hair()), planned);
    progress_.begin_run(record.test + ", " + words_of(planned));
    std::future<Result<Trajectory>> exact;
    const bool is_default_effort =
        std::isnan(setting.effort) || setting.effort == effort_values(*setting.row, {1.0}).front();
    if (bench.runs_kernel(setting) && (is_default_effort || grid_.has_every_effort))
      exact = std::async(std::launch::async, [&] { return in_double(set, setting); });
    const std::string note = too_slow(set, planned, grid_.motion_s, grid_.strand_count);
    const auto run = note.empty() ? motion.run(bench, setting)
                                  : Result<Trajectory>(Error{ErrorCode::LimitExceeded, note, {}});
    if (run) {
      record.result.error = relative_rms(*run, references.rod);
      record.result.stretch = run->stretch;
      if (!run->is_finite) record.result.note = "not finite";
      const auto refined = references.refined.find({setting.row->name, setting.material});
      if (refined != references.refined.end()) {
        record.refined_rate_hz = refined->second.rate_hz;
        record.model_error = relative_rms(refined->second.trajectory, references.rod);
        record.discretisation_error = relative_rms(*run, refined->second.trajectory);
      }
      add_time(set, planned, record);
    } else {
      record.result.note = run.error().to_string();
    }
    if (exact.valid()) {
      const auto trajectory = exact.get();
      if (run && trajectory) record.float_error = relative_rms(*run, *trajectory);
    }
    progress_.end_run(cost_of(setting, grid_.motion_s));
    return record;
  }

  const WorkGrid& grid_;
  std::vector<const SolverRow*> rows_;
  const std::vector<Workbench>& benches_;
  Progress progress_;
  std::vector<HairSet> sets_;
  std::vector<Planned> analytic_runs_;
};

Result<std::vector<const SolverRow*>> chosen_rows(const std::vector<std::string>& names) {
  std::vector<const SolverRow*> rows;
  for (const std::string& name : names) {
    ASSIGN_OR_RETURN(const SolverRow* row, find_solver(name));
    rows.push_back(row);
  }
  if (names.empty()) {
    for (const SolverRow& row : solver_table()) rows.push_back(&row);
  }
  return rows;
}

Result<std::vector<MotionHair>> chosen_hairs(const std::vector<std::string>& names) {
  std::vector<MotionHair> hairs;
  for (const MotionHair hair : kMotionHairs)
    if (names.empty() || std::find(names.begin(), names.end(), to_string(hair)) != names.end())
      hairs.push_back(hair);
  for (const std::string& name : names) {
    const bool is_known = std::any_of(std::begin(kMotionHairs), std::end(kMotionHairs),
                                      [&](MotionHair hair) { return name == to_string(hair); });
    if (!is_known)
      return make_error(ErrorCode::BadInput, "unknown --hair '{}' (known: straight, curled, styled)",
                        name.substr(0, 32));
  }
  return hairs;
}

Status check_grid(const WorkGrid& grid) {
  // Catenaries need three free segments; a strand of more vertices than a scene may have measures nothing.
  constexpr uint32_t kFewestVertices = 6;
  for (const uint32_t count : grid.vertices) {
    if (count < kFewestVertices || count > kMaxVertexCount)
      return make_error(ErrorCode::BadInput, "--vertices is {} (allowed: {} to {})", count, kFewestVertices,
                        kMaxVertexCount);
  }
  constexpr double kHighestHz = 960.0;
  for (const double rate_hz : grid.rates_hz) {
    const double samples = rate_hz * MotionSet::kSampleS;
    if (!(samples >= 1.0) || std::abs(samples - std::round(samples)) > 1e-9 || rate_hz > kHighestHz)
      return make_error(ErrorCode::BadInput, "--rate is {:g} Hz (allowed: multiples of {:g} up to {:g})",
                        rate_hz, 1.0 / MotionSet::kSampleS, kHighestHz);
  }
  constexpr double kLongestS = 60.0;
  if (!(grid.motion_s >= MotionSet::kSampleS) || grid.motion_s > kLongestS)
    return make_error(ErrorCode::BadInput, "--seconds is {:g} (allowed: {:.3f} to {:g})", grid.motion_s,
                      MotionSet::kSampleS, kLongestS);
  return {};
}

}  // namespace

std::string motion_test(MotionHair hair) {
  return fmt::format("motion, {} hair", to_string(hair));
}

void add_time(WorkRecord& record, const StrandTime& time) {
  record.us = us_per_frame(time.best_us, record.setting);
  record.median_us = us_per_frame(time.median_us, record.setting);
}

WorkGrid make_work_grid(const WorkPrecisionOptions& options) {
  WorkGrid grid;
  if (options.is_quick) {
    grid.effort_factors = {1.0, 4.0};
    grid.substeps = {1};
    grid.analytic_vertices = {8, 32};
    grid.analytic_rates_hz = {60.0, 240.0};
    grid.motion_s = 2.0;
    grid.reference_vertices = 64;
    grid.reference_rate_hz = 1920.0;
    grid.check_rate_hz = 1920.0;
    grid.refined_rate_hz = 1920.0;
    grid.longest_run_s = 4.0;
  } else {
    grid.effort_factors = {0.25, 1.0, 2.0, 4.0};
    grid.substeps = {1, 4};
    grid.analytic_vertices = grid.vertices;
    grid.analytic_rates_hz = grid.rates_hz;
    grid.has_every_effort = true;
    grid.strand_count = 16;
  }
  if (!options.vertices.empty()) grid.vertices = grid.analytic_vertices = options.vertices;
  if (!options.rates_hz.empty()) grid.rates_hz = grid.analytic_rates_hz = options.rates_hz;
  if (options.motion_s != 0.0) grid.motion_s = options.motion_s;
  return grid;
}

Result<WorkReport> measure_work_precision(const WorkPrecisionOptions& options) {
  WorkReport report;
  report.is_quick = options.is_quick;
  report.grid = make_work_grid(options);
  RETURN_IF_ERROR(check_grid(report.grid));
  ASSIGN_OR_RETURN(std::vector<const SolverRow*> rows, chosen_rows(options.solvers));
  ASSIGN_OR_RETURN(report.grid.hairs, chosen_hairs(options.hairs));
  std::vector<MotionSet> motions;
  for (const MotionHair hair : report.grid.hairs) {
    ASSIGN_OR_RETURN(MotionSet motion,
                     MotionSet::make({options.motion, report.grid.motion_s, report.grid.strand_count, hair,
                                      options.motion_file}));
    motions.push_back(std::move(motion));
  }
  report.motion_name = options.motion.empty() ? "built-in head motion" : options.motion.filename().string();
  ASSIGN_OR_RETURN(const auto executors, open_report_executors(options.device));
  std::vector<Workbench> benches;
  for (const auto& executor : executors) {
    report.executors.push_back(executor->info());
    benches.push_back({executor.get()});
  }
  if (benches.empty()) benches.emplace_back();
  RETURN_IF_ERROR(Measurement(report.grid, motions, std::move(rows), benches).run(report));
  return report;
}

}  // namespace strandcast
