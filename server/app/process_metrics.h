// Resource use of the process, under the names that Prometheus' own clients use. Linux; any thread.
#pragma once

#include <string>

namespace strandcast {

/// Returns the lines for /metrics; values that cannot be read are omitted.
std::string format_process_metrics();

}  // namespace strandcast
