// The viewer's window. Main thread only.
#pragma once

#include <atomic>

#include "client/app/view_options.h"
#include "client/app/view_report.h"

namespace strandcast {

/// Shows the server's hair until the person quits, the time in the options is over or `stop` is set. The
/// error is one sentence for the user: no server, no display, or a permanent refusal.
Result<ViewReport> run_windowed(const ViewOptions& options, const std::atomic<bool>& stop);

}  // namespace strandcast
