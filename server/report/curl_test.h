// T12: a curl as a spring. A helix of hair hangs under its own weight. With a small pitch its extension is
// all twist. A section that bears the weight w (L - s) at the arm R is twisted by w (L - s) R / GJ per
// length. So the end sinks by w R^2 L^2 / (2 GJ), which is m g / 2 k with the spring's k = G r^4 / (4 N R^3).
#pragma once

#include "server/report/analytic_tests.h"

namespace strandcast {

// Segments of a thirteenth of a turn; with fewer vertices it is no helix.
inline constexpr uint32_t kCurlVertices = 64;

/// Returns whether the row has a twist parameter.
bool has_twist(const SolverRow& row);

/// Measures the error of the extension. A few percent are the formula's own, because the last turn's weight
/// acts off the axis.
AnalyticResult run_curl(const Workbench& workbench, const RunSetting& setting);

}  // namespace strandcast
