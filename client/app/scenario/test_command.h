// strandcast-ctl test: runs scenarios in order, prints a line per check, and writes JUnit XML.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "client/app/ctl_commands.h"

namespace strandcast {

struct TestOptions {
  std::vector<std::filesystem::path> scenarios;
  std::filesystem::path junit;  // empty = none
  std::filesystem::path out = "out/test";
  std::filesystem::path server;  // empty: strandcast-server beside this program
  bool uses_running = false;     // the target's server instead of one of its own
  bool renews_goldens = false;
};

/// Runs the scenarios. Exit code: 0 = all checks hold, 1 = a check fails, 2 = a file is wrong or there is no
/// server.
int run_test(const CtlTarget& target, const TestOptions& options, const std::atomic<bool>& stop);

}  // namespace strandcast
