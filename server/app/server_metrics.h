// Metrics of simulation, encoders and viewers for /metrics. Pure functions, any thread.
#pragma once

#include <string>
#include <vector>

#include "server/app/server.h"

namespace strandcast {

/// Formats the counters as Prometheus text.
std::string format_server_metrics(const ServerCounters& counters, const char* version);

/// Prometheus text of one head.
struct HeadMetrics {
  std::string head;    // its name
  std::string before;  // what there is about the process
  std::string after;
};
/// Joins the texts of all heads. A single head's text stays unchanged. With several, each metric family
/// appears once and its lines get the label "head", except for metrics of the process.
std::string join_metrics(const std::vector<HeadMetrics>& heads, const std::string& process);

}  // namespace strandcast
