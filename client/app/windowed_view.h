// The viewer with a window. Main thread only.
#pragma once

#include <atomic>

#include "client/app/view_options.h"
#include "client/app/view_report.h"

namespace strandcast {

/// Shows the server's hair until the person quits, the options' time is over or `stop` is set. The error is
/// one sentence for the user: no server, no display, or a refusal that will not go away.
Result<ViewReport> run_windowed(const ViewOptions& options, const std::atomic<bool>& stop);

}  // namespace strandcast
