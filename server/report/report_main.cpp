// strandcast-report: measures strand models and strand codecs and writes tables, plots and pages that a
// person can read. Exit code 0 when all was measured and written, 2 for bad input.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

#include "common/base/command_line_error.h"
#include "common/log/log.h"
#include "server/report/report_commands.h"

namespace strandcast {
namespace {

constexpr int kExitBadInput = 2;
constexpr int kExitFailure = 1;

constexpr AddReportCommand kCommands[] = {
    add_work_precision_command, add_coherence_command, add_collisions_command, add_pictures_command,
    add_pruning_command,        add_recommend_command, add_rendering_command,  add_scalp_command,
    add_stability_command,      add_streaming_command, add_volume_command};

int run(int argc, const char* const* argv) {
  CLI::App app("Measures strand models and strand codecs.", "strandcast-report");
  app.require_subcommand(1);
  ReportAction action;
  for (const AddReportCommand add : kCommands) add(app, action);
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    fmt::print("{}", app.help());
    return 0;
  } catch (const CLI::ParseError& error) {
    fmt::print(stderr, "strandcast-report: {} (--help lists the commands and options)\n",
               command_line_error(error.what()));
    return kExitBadInput;
  }
  init_log("warn");
  const Status status = action();
  if (status) return 0;
  fmt::print(stderr, "strandcast-report: {}\n", status.error().to_string());
  return status.error().code == ErrorCode::Internal ? kExitFailure : kExitBadInput;
}

}  // namespace
}  // namespace strandcast

int main(int argc, char** argv) {
  try {
    return strandcast::run(argc, argv);
  } catch (const std::exception& exception) {
    std::fprintf(stderr, "strandcast-report: %s\n", exception.what());
    return strandcast::kExitFailure;
  }
}
