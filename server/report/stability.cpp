#include "server/report/stability.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "common/log/progress.h"
#include "server/report/report_commands.h"
#include "server/report/report_files.h"
#include "server/report/report_options.h"

namespace strandcast {
namespace {

double steps_of(const StabilityTrial& trial) {
  return (trial.moving_s + trial.still_s) / trial.substep_s(0);
}

}  // namespace

Status run_stability(const StabilityOptions& options) {
  std::vector<const SolverRow*> rows;
  for (const std::string& name : options.solvers) {
    ASSIGN_OR_RETURN(const SolverRow* row, find_solver(name));
    rows.push_back(row);
  }
  if (rows.empty())
    for (const SolverRow& row : solver_table()) rows.push_back(&row);
  RETURN_IF_ERROR(make_report_folder(options.out));
  ASSIGN_OR_RETURN(const auto executor, open_executor(options.device));
  const StabilityGrid grid = options.is_quick ? StabilityGrid::Quick : StabilityGrid::Full;
  const std::vector<StabilityTrial> trials = make_stability_trials(grid);

  std::vector<StabilityOutcome> outcomes;
  {
    Progress progress({"stability"});
    for (const SolverRow* row : rows)
      for (const StabilityTrial& trial : trials)
        if (is_for(*row, trial)) progress.expect(1, steps_of(trial));
    StabilityRunner runner(executor.get());
    for (const SolverRow* row : rows) {
      for (const StabilityTrial& trial : trials) {
        if (!is_for(*row, trial)) continue;
        progress.begin_run(fmt::format("{}, {}", row->name, trial.setting));
        ASSIGN_OR_RETURN(StabilityOutcome outcome, runner.run(*row, trial));
        outcomes.push_back(std::move(outcome));
        progress.end_run(steps_of(trial));
      }
    }
  }
  fmt::print("{}", stability_text(outcomes));
  const std::filesystem::path csv_path = options.out / "stability.csv";
  const std::filesystem::path page_path = options.out / "stability.html";
  RETURN_IF_ERROR(save_text(csv_path, stability_csv(outcomes)));
  RETURN_IF_ERROR(save_text(page_path, stability_page(outcomes, {executor->info().name, grid})));
  fmt::print("{}\n{}\n", csv_path.string(), page_path.string());
  return {};
}

void declare_stability(CLI::App& command, StabilityOptions& options) {
  command.add_option("--out", options.out, "folder for the CSV and the page")->required();
  command.add_option("--solver", options.solvers, "only this one; repeatable")->expected(1)->take_all();
  add_sim_device_options(command, options.device);
  command.add_flag("--quick", options.is_quick, "fewer settings and shorter rests");
}

void add_stability_command(CLI::App& app, ReportAction& action) {
  const auto options = std::make_shared<StabilityOptions>();
  CLI::App* command =
      app.add_subcommand("stability", "every strand model against stiff and extreme cases, with limits");
  declare_stability(*command, *options);
  command->callback([options, &action] { action = [options] { return run_stability(*options); }; });
}

}  // namespace strandcast
