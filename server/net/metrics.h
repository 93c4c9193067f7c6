// Prometheus text of the network counters. Any thread.
#pragma once

#include <string>

#include "server/net/net_server.h"

namespace strandcast {

/// One line of Prometheus text with its type; `type` is "counter" or "gauge".
std::string format_metric(const std::string& name, const char* type, double value);

std::string format_metrics(const NetCounters& counters);

}  // namespace strandcast
