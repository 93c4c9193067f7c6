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

}  // namespace strandcast
