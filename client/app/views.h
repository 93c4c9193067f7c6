// What strandcast-view does with its options: a window, no window, or a recording. Main thread only.
#pragma once

#include <atomic>

#include "client/app/view_options.h"
#include "client/app/view_report.h"
#include "common/base/result.h"

namespace strandcast {

/// Shows the server's hair until the person quits, the time in the options is over or `stop` is set. The
/// error is one sentence for the user: no server, no display, or a permanent refusal.
Result<ViewReport> run_windowed(const ViewOptions& options, const std::atomic<bool>& stop);

/// Receives for a while, then renders what it decoded into a picture and a clip, so that a slow renderer
/// distorts neither times nor measurements. The error is one sentence for the user. `stop` ends it early
/// (Ctrl-C): then there is a report, but nothing is drawn any more. Between two frames that are decoded and
/// two pictures that are drawn it looks at `stop`, and, until it draws, at the time limit.
Result<ViewReport> run_headless(const ViewOptions& options, const std::atomic<bool>& stop);

/// Plays a recording in a window, with pause, seeking, loop and speed, until the window is closed. Returns
/// the errors of RecordingPlayer::open(), of the window and of drawing.
Status run_playback(const ViewOptions& options, const std::atomic<bool>& stop);

}  // namespace strandcast
