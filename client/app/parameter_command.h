// strandcast-ctl params: prints the parameters of a running server with units, ranges, defaults and present
// values, and optionally their changes.
#pragma once

#include "client/app/ctl_commands.h"

namespace strandcast {

struct ParameterOptions {
  std::string prefix;         // of the paths; empty = all
  bool is_watching = false;   // stay, and print what changes
  bool is_live_only = false;  // those alone that can change while the server runs
};

/// Formats a parameter: "look.ambient  0.25  (0 .. 1, default 0.5)  live".
std::string to_line(const ParameterInfo& parameter);

int run_params(const CtlTarget& target, const ParameterOptions& options, const std::atomic<bool>& stop);

}  // namespace strandcast
