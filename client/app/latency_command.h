// strandcast-ctl latency: watches as a viewer for a while and prints the duration of each stage from motion
// sample to picture.
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
