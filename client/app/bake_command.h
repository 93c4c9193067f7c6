// strandcast-ctl bake: hair and a clip of motion in, a file of simulated hair out. It runs a server of its
// own.
#pragma once

#include <atomic>
#include <filesystem>
#include <string>
#include <vector>

#include "client/app/ctl_commands.h"
#include "client/app/export_command.h"

namespace CLI {
class App;
}

namespace strandcast {

/// Time before the first frame in which the motion sets in, s.
inline constexpr double kUsualLeadS = 1.0;

struct BakeCommand {
  ExportCommand exported;              // its paths: hair files, then the file to write
  FeedOptions feed;                    // motion and wind
  std::filesystem::path scene;         // empty: the built-in one
  std::vector<std::string> overrides;  // of the scene
  std::filesystem::path server;        // empty: strandcast-server beside this program
  double lead_s = kUsualLeadS;
  bool is_replacing = false;  // a file that is there
};

/// Adds the options of how to read a BVH file; `prefix` begins the names of unit and up axis.
void declare_motion_file(CLI::App& app, MotionFileOptions& options, const std::string& prefix);

/// Adds the options of the sub-command to `app`; `app` and `command` must exist until the command line is
/// parsed.
void declare_bake(CLI::App& app, BakeCommand& command);

/// Returns the words of the server's command line.
std::vector<std::string> server_words(const BakeCommand& command);

/// Exit code: 1 when it was stopped, 2 for bad input and when the server or the file fails.
int run_bake(const BakeCommand& command, const std::atomic<bool>& stop);

}  // namespace strandcast
