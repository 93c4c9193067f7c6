// A recording in a window: played, paused, scrubbed, looped, slower or faster.
#pragma once

#include <atomic>

#include "client/app/view_options.h"
#include "common/base/result.h"

namespace strandcast {

/// Runs until the window is closed. The errors of RecordingPlayer::open(), of the window and of drawing.
Status run_playback(const ViewOptions& options, const std::atomic<bool>& stop);

}  // namespace strandcast
