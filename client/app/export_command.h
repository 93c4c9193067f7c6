// strandcast-ctl export: writes strands of a running server or a recording to a file for other programs.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/app/ctl_commands.h"
#include "client/app/hair_origin.h"
#include "client/export/export_strands.h"
#include "common/scene/scene_desc.h"

namespace CLI {
class App;
}

namespace strandcast {

struct ExportCommand {
  std::vector<std::string> paths;  // the file to write; before it a recording, instead of a server
  std::optional<std::string> fps;
  std::vector<std::string> grooms;      // the hair's files, to carry on what they say
  std::optional<std::string> unit, up;  // empty: as the hair's files, else cm and y
  std::optional<std::string> space;     // empty: the head's
  bool is_guides = false;
  bool is_drawn = false;
  bool has_followers = false;
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

/// How the strands of an export are dressed.
struct ExportDress {
  std::optional<HairOrigin> origin;  // what the hair's files say, to be carried on; empty: nothing
  LookDesc look;                     // that they are drawn with
};

/// Exports states with what the hair's files say and as viewers draw them, as the command asks. Errors of
/// as_drawn() and export_strands().
Result<ExportReport> export_dressed(std::unique_ptr<ExportSource> states, const ExportDress& dress,
                                    const ExportCommand& command, ExportOptions options,
                                    const std::atomic<bool>& stop);

/// Prints what was written; `clock` stands behind the time of the first frame.
void print_export(const ExportReport& report, std::string_view clock = {});

int run_export(const CtlTarget& target, const ExportCommand& command, const std::atomic<bool>& stop);

}  // namespace strandcast
