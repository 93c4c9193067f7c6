// Plays a recording in a window, with pause, seeking, loop and speed.
#pragma once

#include <atomic>

#include "client/app/view_options.h"
#include "common/base/result.h"

namespace strandcast {

/// Runs until the window is closed. Returns the errors of RecordingPlayer::open(), of the window and of
/// drawing.
Status run_playback(const ViewOptions& options, const std::atomic<bool>& stop);

}  // namespace strandcast
