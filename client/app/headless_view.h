// The viewer without a window: receives for a while, then renders what it decoded into a picture and a clip.
// Receiving comes first and rendering after it, so that a slow software renderer distorts neither times nor
// measurements.
#pragma once

#include <atomic>

#include "client/app/view_options.h"
#include "client/app/view_report.h"

namespace strandcast {

/// Runs to the end its options ask for; the error is one sentence for the user. `stop` ends it early
/// (Ctrl-C): then there is a report, but nothing is drawn any more. Between two frames that are decoded and
/// two pictures that are drawn it looks at `stop`, and, until it draws, at the time limit.
Result<ViewReport> run_headless(const ViewOptions& options, const std::atomic<bool>& stop);

}  // namespace strandcast
