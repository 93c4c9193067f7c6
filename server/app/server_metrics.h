// What /metrics says about simulation, encoders and viewers. Pure functions, any thread.
#pragma once

#include <string>
#include <vector>

#include "server/app/server.h"

namespace strandcast {

/// Prometheus text.
std::string format_server_metrics(const ServerCounters& counters, const char* version);

/// Prometheus text about one head.
struct HeadMetrics {
  std::string head;    // its name
  std::string before;  // what there is about the process
  std::string after;
};
/// All of it as one text. Of one head as it is; of several each family once, its lines with the label "head",
/// but for what is the process's own.
std::string join_metrics(const std::vector<HeadMetrics>& heads, const std::string& process);

}  // namespace strandcast
