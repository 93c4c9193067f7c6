#include "server/report/work_precision.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "server/report/report_commands.h"
#include "server/report/report_folder.h"
#include "server/sim/solver_registry.h"

namespace strandcast {

Status run_work_precision(const WorkPrecisionOptions& options) {
  for (const std::string& name : options.solvers) {
    const auto row = find_solver(name);
    if (!row) return row.error();
  }
  return make_report_folder(options.out);
}

void add_work_precision_command(CLI::App& app, ReportAction& action) {
  const auto options = std::make_shared<WorkPrecisionOptions>();
  CLI::App* command = app.add_subcommand("work-precision", "error against run time of every strand model");
  command->add_option("--out", options->out, "folder for the CSV, plots and page")->required();
  command->add_option("--solver", options->solvers, "only this one; repeatable")->expected(1)->take_all();
  command->add_option("--motion", options->motion, "head motion from this .bvh file; default: built in");
  command->add_option("--gl-device", options->gl_device, "auto, software, hardware or a device number")
      ->capture_default_str();
  command->add_flag("--quick", options->is_quick, "fewer runs: about two minutes on two cores");
  command->callback([options, &action] { action = [options] { return run_work_precision(*options); }; });
}

}  // namespace strandcast
