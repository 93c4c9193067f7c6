// What the process takes of the machine, by the names that Prometheus' own clients use. Linux; any thread.
#pragma once

#include <string>

namespace strandcast {

/// Lines for /metrics; what cannot be read is left out.
std::string format_process_metrics();

}  // namespace strandcast
