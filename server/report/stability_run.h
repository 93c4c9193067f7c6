// StabilityRunner: runs a row of the solver table through the trials and judges the measures by the row's
// promises. Runs on the executor's thread.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/report/stability_trial.h"
#include "server/sim/executor/executor.h"

namespace strandcast {

/// Limit that a row promises for a measure in a trial. A measure without a promise is shown without
/// judgement.
struct StabilityPromise {
  double limit = 0.0;
  bool is_promised = true;
};
StabilityPromise stability_promise(const SolverRow& row, const StabilityTrial& trial,
                                   StabilityMeasure measure);
/// Explains the limits of a measure in a few sentences.
std::string promise_reason(StabilityMeasure measure);

/// A promise that a row is known to break in one trial, with the measured value and the reason. Reports show
/// such cells red like any other; tests expect exactly these breaks, none beyond its ceiling.
struct KnownBreak {
  const char* row;
  const char* group;
  const char* setting;
  StabilityMeasure measure;
  double measured;  // on llvmpipe
  const char* reason;

  /// Returns the largest accepted value; devices round differently, and unstable cases amplify rounding.
  double ceiling() const { return 1.3 * measured; }
};
const std::vector<KnownBreak>& known_breaks();

struct StabilityCell {
  double value = 0.0;
  StabilityPromise promise;
  const KnownBreak* known_break = nullptr;
  bool is_kept() const { return !promise.is_promised || value <= promise.limit; }
};

struct StabilityOutcome {
  std::string row;
  std::string group;
  std::string setting;
  std::string note;     // parameters that were changed
  std::string refusal;  // not run: why the server refuses such a scene
  std::array<std::optional<StabilityCell>, kStabilityMeasureCount> cells;
};

class StabilityRunner {
 public:
  /// Makes a runner; nullptr: references only.
  explicit StabilityRunner(Executor* executor) : executor_(executor) {}

  /// Runs a trial with the row's kernel if it has one, otherwise with its reference. The error names the row
  /// and what failed.
  Result<StabilityOutcome> run(const SolverRow& row, const StabilityTrial& trial);

 private:
  Result<Solver*> solver_for(const SolverRow& row, const SolverParameters& complete);

  Executor* executor_;
  std::string row_name_;  // of the solvers kept
  std::map<SolverParameters, std::unique_ptr<Solver>> solvers_;
};

}  // namespace strandcast
