// Ctrl-C and SIGTERM as a flag that loops look at. Process-wide.
#pragma once

#include <atomic>

namespace strandcast {

/// Catches SIGINT and SIGTERM from now on; a second one ends the process at once.
const std::atomic<bool>& catch_stop_signals();

}  // namespace strandcast
