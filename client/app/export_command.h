// strandcast-ctl export: writes strands of a running server or a recording to a file for other programs.
#pragma once

#include <atomic>
#include <optional>
#include <string>
#include <vector>

#include "client/app/ctl_commands.h"
#include "client/export/export_strands.h"

namespace CLI {
class App;
}

namespace strandcast {

struct ExportCommand {
  std::vector<std::string> paths;  // the file to write; before it a recording, instead of a server
  std::optional<std::string> fps;
  std::string unit = "cm";
  std::string up = "y";
  std::string space = "head";
  bool is_guides = false;
  bool is_drawn = false;
  bool has_head = false;
  std::optional<std::string> from, to;  // seconds or timecode
  std::optional<double> seconds, at_s;
};

/// Adds the options of the sub-command to `app`; `app` and `command` must exist until the command line is
/// parsed.
void declare_export(CLI::App& app, ExportCommand& command);
/// Adds all of them but the paths.
void declare_export_options(CLI::App& app, ExportCommand& command);

/// Converts and checks the command line's options. BadInput says which combinations are possible.
Result<ExportOptions> export_options(const ExportCommand& command);

/// Prints what was written.
void print_export(const ExportReport& report);

int run_export(const CtlTarget& target, const ExportCommand& command, const std::atomic<bool>& stop);

}  // namespace strandcast
