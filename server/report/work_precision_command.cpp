#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "common/base/command_line_error.h"
#include "server/report/report_commands.h"
#include "server/report/report_files.h"
#include "server/report/report_options.h"
#include "server/report/work_precision_page.h"

namespace strandcast {

Status run_work_precision(const WorkPrecisionOptions& options) {
  // Before anything is measured for minutes.
  RETURN_IF_ERROR(make_report_folder(options.out));
  ASSIGN_OR_RETURN(const WorkReport report, measure_work_precision(options));
  RETURN_IF_ERROR(save_work_precision(report, options.out));
  fmt::print("{}\n{}\n", work_precision_summary(report), (options.out / kWorkPrecisionPage).string());
  return {};
}

void declare_work_precision(CLI::App& command, WorkPrecisionOptions& options) {
  command.add_option("--out", options.out, "folder for the CSV, plots and page")->required();
  command.add_option("--solver", options.solvers, "only this one; repeatable")->expected(1)->take_all();
  command.add_option("--motion", options.motion, "head motion from this .bvh file; default: built in");
  add_motion_file_options(command, options.motion_file);
  command.add_option("--hair", options.hairs, "only this hair: straight, curled or styled; repeatable")
      ->expected(1)
      ->take_all();
  command.add_option("--vertices", options.vertices, "only this many per strand; repeatable")
      ->expected(1)
      ->take_all();
  command.add_option("--rate", options.rates_hz, "only this many steps per second; repeatable")
      ->expected(1)
      ->take_all();
  command.add_option("--seconds", options.motion_s, "length of the measured motion")
      ->check(without_nan(CLI::PositiveNumber));
  add_sim_device_options(command, options.device, {true, "double-precision references only"});
  command.add_flag("--quick", options.is_quick, "fewer runs: some minutes on two cores");
}

void add_work_precision_command(CLI::App& app, ReportAction& action) {
  const auto options = std::make_shared<WorkPrecisionOptions>();
  CLI::App* command = app.add_subcommand("work-precision", "error against run time of every strand model");
  declare_work_precision(*command, *options);
  command->callback([options, &action] { action = [options] { return run_work_precision(*options); }; });
}

}  // namespace strandcast
