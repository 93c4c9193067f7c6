// Result of a scenario: a line per check for people, JUnit XML for build servers, and a plot of the
// measurements. Pure text, any thread.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace strandcast {

struct CheckResult {
  int line = 0;        // of the scenario's file
  std::string what;    // "stretch of viewer"
  std::string wanted;  // empty: an action that could not be done
  std::string measured;
  bool has_passed = false;
  double seconds = 0.0;     // since the one before
  std::string detail = {};  // where, and what helps, should it fail; empty: nothing is known
};

/// Measurements at one moment.
struct TraceSample {
  double time_s = 0.0;     // since the start of the scenario
  std::string viewer;      // empty: of the server
  double realtime = -1.0;  // -1 = not measured here
  double stretch = -1.0;
  double kbit = -1.0;  // per second
  double hz = -1.0;
};

inline constexpr size_t kMaxTraceSamples = 20'000;

/// A limit that a measure was held to, for its plot.
struct WantedLimit {
  double TraceSample::*measure = nullptr;
  std::string name;  // "wanted below 0.01"
  double value = 0.0;
};

struct ScenarioResult {
  std::string name;
  std::string about;
  double seconds = 0.0;
  std::vector<CheckResult> checks;
  std::vector<TraceSample> trace;
  std::vector<WantedLimit> wanted;
  std::vector<uint64_t> hashes;  // after each step, in order
  bool is_file_wrong = false;    // what stopped it stands in the scenario

  size_t failed_count() const;
};

/// Formats a check: "  ok    12  stretch of viewer: wanted below 0.01, measured 0.002". Of one that fails,
/// what was measured comes first, and the detail last.
std::string to_line(const CheckResult& check);

/// Formats JUnit XML with one <testsuite> per scenario and one <testcase> per check.
std::string to_junit(const std::vector<ScenarioResult>& results);

/// Plots stretch, speed, kbit/s and frames per second over time with what was wanted of them, as SVG.
std::string to_plot(const ScenarioResult& result);

}  // namespace strandcast
