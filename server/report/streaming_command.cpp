#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "common/base/command_line_error.h"
#include "server/report/report_commands.h"
#include "server/report/report_files.h"
#include "server/report/report_options.h"
#include "server/report/streaming_page.h"

namespace strandcast {
namespace {

// From a clone that has the project's shared data beside it.
constexpr const char* kClips = "../shared/data/mocap";

}  // namespace

Status run_streaming(const StreamingOptions& options) {
  // Before anything is measured for minutes.
  RETURN_IF_ERROR(make_report_folder(options.out));
  const auto save = [&](const StreamingReport& report) { return save_streaming(report, options.out); };
  ASSIGN_OR_RETURN(const StreamingReport report, measure_streaming(options, save));
  fmt::print("{}{}\n{}\n", streaming_summary(report), (options.out / kStreamingCsv).string(),
             (options.out / kStreamingPage).string());
  return {};
}

void declare_streaming(CLI::App& command, StreamingOptions& options) {
  command.add_option("--out", options.out, "folder for the CSV, plots and page")->required();
  command
      .add_option("--motion", options.motions,
                  "head motion from this .bvh file; repeatable; default: built in")
      ->expected(1)
      ->take_all();
  add_motion_file_options(command, options.motion_file);
  command.add_option("--size", options.sizes, "STRANDSxVERTICES; repeatable; default: 10000x16, 2228x32")
      ->expected(1)
      ->take_all();
  command
      .add_option("--clips", options.clips,
                  "folder of captured heads to run beside the built-in ones, as far as they are there; "
                  "default: ../shared/data/mocap, with --quick or --motion none")
      ->excludes("--motion");
  command
      .add_option(
          "--solver", options.solvers,
          "what moves the strands; repeatable: plots and the goals of tangent are of the first; default: the "
          "built-in scene's, direct_rod, mass_spring; with --quick the built-in scene's")
      ->expected(1)
      ->take_all();
  command.add_option(
      "--view", options.view,
      "WIDTHxHEIGHT of the pictures that are compared; default: 1280x720, with --quick 320x180");
  command
      .add_option("--seconds", options.seconds,
                  "recorded of each part of a motion, the median and the wildest; default: 0.5")
      ->check(without_nan(CLI::PositiveNumber));
  add_sim_device_options(command, options.device, {false, "the solver in double precision"});
  command.add_flag("--quick", options.is_quick, "fewer and smaller: a minute or two on two cores");
}

void add_streaming_command(CLI::App& app, ReportAction& action) {
  const auto options = std::make_shared<StreamingOptions>();
  CLI::App* command = app.add_subcommand(
      "streaming", "error, bytes and milliseconds of every strand codec, beside general codecs");
  declare_streaming(*command, *options);
  command->callback([options, &action] {
    if (options->clips.empty() && options->motions.empty() && !options->is_quick) options->clips = kClips;
    action = [options] { return run_streaming(*options); };
  });
}

}  // namespace strandcast
