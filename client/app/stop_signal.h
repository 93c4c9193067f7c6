// Turns Ctrl-C and SIGTERM into a flag that loops check. Process-wide.
#pragma once

#include <atomic>
#include <chrono>

namespace strandcast {

/// Time that current work may take after the first signal.
inline constexpr std::chrono::milliseconds kStopGrace{750};

/// Catches SIGINT and SIGTERM from now on; the first signal sets the returned flag. A second signal ends the
/// program, and so does the first if the program is still running after kStopGrace.
const std::atomic<bool>& catch_stop_signals();

/// Returns what shells expect of a program that was stopped before it was done: 130 after Ctrl-C.
int stopped_exit_code();

}  // namespace strandcast
