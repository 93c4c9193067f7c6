// Work-precision tests with an exact answer: a strand model at one setting against theory. Tables name the
// tests T1 to T18. A test runs with the row's kernel if it has one, otherwise with its reference.
//
// Not here: twisted rings (T11: a step has no such input), and the largest stable stiffness (T8:
// strandcast-report stability).
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "server/report/strand_run.h"

namespace strandcast {

/// Result of a test; NaN = not measured by this test.
struct AnalyticResult {
  double value = std::numeric_limits<double>::quiet_NaN();
  double exact = std::numeric_limits<double>::quiet_NaN();
  double error = std::numeric_limits<double>::quiet_NaN();          // relative, as the test's summary says
  double period_error = std::numeric_limits<double>::quiet_NaN();   // relative
  double damping_ratio = std::numeric_limits<double>::quiet_NaN();  // measured over predicted
  double droop = std::numeric_limits<double>::quiet_NaN();          // of the tip, over the length
  double stretch = 0.0;                                             // largest at any step
  std::string note;                                                 // why there is no number
};

struct AnalyticTest {
  std::string name;     // "T1 Gamma 10"
  std::string summary;  // what is compared, and what `error` is
  Material material = Material::Hair;
  double fixed_rate_hz = 0.0;       // 0 = any
  uint32_t fixed_vertex_count = 0;  // 0 = any
  bool is_quick = true;             // part of a quick run
  double simulated_s = 1.0;         // about, for progress
  AnalyticResult (*run)(const Workbench& workbench, const RunSetting& setting);
};

/// Returns all tests in the order of their numbers.
const std::vector<AnalyticTest>& analytic_tests();

/// Returns whether the row has what the test needs: constants of hair, parameters for a chain, or twist.
bool has_physics(const SolverRow& row, const AnalyticTest& test);

// T12: a curl as a spring. A helix of hair hangs under its own weight. With a small pitch its extension is
// all twist. A section that bears the weight w (L - s) at the arm R is twisted by w (L - s) R / GJ per
// length. So the end sinks by w R^2 L^2 / (2 GJ), which is m g / 2 k with the spring's k = G r^4 / (4 N R^3).

// Segments of a thirteenth of a turn; with fewer vertices it is no helix.
inline constexpr uint32_t kCurlVertices = 64;

/// Returns whether the row has a twist parameter.
bool has_twist(const SolverRow& row);

/// Measures the error of the extension. A few percent are the formula's own, because the last turn's weight
/// acts off the axis.
AnalyticResult run_curl(const Workbench& workbench, const RunSetting& setting);

// T18: the set-up with which Mueller et al. (Fast Simulation of Inextensible Hair and Fur, 2012) compare
// models: 30 particles 2 cm apart, steps of 10 ms, gravity 10 m/s^2. Here the chain is released from
// horizontal and compared with one solved in small steps in double precision.

inline constexpr uint32_t kPaperChainVertices = 30;
inline constexpr double kPaperChainRateHz = 100.0;

/// Measures the error: RMS distance of the particles from the exact ones, relative to the length.
AnalyticResult run_paper_chain(const Workbench& workbench, const RunSetting& setting);

}  // namespace strandcast
