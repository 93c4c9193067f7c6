// Ctrl-C and SIGTERM as a flag that loops look at. Process-wide.
#pragma once

#include <atomic>
#include <chrono>

namespace strandcast {

/// How long whatever is under way may take after the first signal.
inline constexpr std::chrono::milliseconds kStopGrace{750};

/// Catches SIGINT and SIGTERM from now on. The first one sets the flag, and a program that looks at it ends
/// in its own way; one that is still there after kStopGrace, in the middle of something long, is ended by
/// that signal, and so is one that gets a second.
const std::atomic<bool>& catch_stop_signals();

}  // namespace strandcast
