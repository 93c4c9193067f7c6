// strandcast-ctl latency: watches for a while as a viewer, and says how long each part of the way takes.
#pragma once

#include "client/app/ctl_commands.h"

namespace strandcast {

struct LatencyOptions {
  double seconds = 10.0;
  std::string mode = "strands";  // or frames
  std::filesystem::path out;     // folder for latency.csv and frames.csv; empty = none
};

int run_latency(const CtlTarget& target, const LatencyOptions& options, const std::atomic<bool>& stop);

}  // namespace strandcast
