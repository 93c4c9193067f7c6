// What /metrics says about simulation, encoders and viewers. Pure functions, any thread.
#pragma once

#include <string>

#include "server/app/server.h"

namespace strandcast {

/// Prometheus text.
std::string format_server_metrics(const ServerCounters& counters, const char* version);

}  // namespace strandcast
