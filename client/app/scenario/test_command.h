// strandcast-ctl test: runs scenarios, some at the same time, prints a line per check, and writes JUnit XML.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "client/app/ctl_commands.h"

namespace strandcast {

inline constexpr uint32_t kMaxTestJobs = 64;

struct TestOptions {
  std::vector<std::filesystem::path> scenarios;  // files, and folders of which every .textproto is taken
  std::filesystem::path junit;                   // empty = none
  std::filesystem::path out = "out/test";
  std::filesystem::path server;  // empty: strandcast-server beside this program
  bool uses_running = false;     // the target's server instead of one of its own
  bool renews_goldens = false;
  uint32_t jobs = 1;         // scenarios at the same time
  bool is_watching = false;  // again after each change of a file or of the server program, until stopped
};

/// Returns the files that are meant: a folder stands for its .textproto files by name. NotFound for a folder
/// without any.
Result<std::vector<std::filesystem::path>> scenario_files(const std::vector<std::filesystem::path>& given);

/// Runs the scenarios. Exit code, with --watch of the last round: 0 = all checks hold, 1 = a check fails, 2 =
/// a file is wrong or there is no server.
int run_test(const CtlTarget& target, const TestOptions& options, const std::atomic<bool>& stop);

}  // namespace strandcast
