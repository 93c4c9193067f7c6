// Times and stretches rows of the solver table, for tables beside those of other programs. The executor's
// thread.
#pragma once

#include <string>

#include "common/groom/groom.h"
#include "server/sim/executor/executor.h"
#include "server/sim/solver_registry.h"

namespace strandcast {

/// Milliseconds of a step of 1/60 s of a lively head without colliders, the best of `steps`, which is nearest
/// to a quiet machine; by its kernel, or the reference of a row without a kernel. Defaults of the row.
Result<double> row_step_ms(const SolverRow& row, const Groom& groom, Executor& executor, int steps);

/// Iterations of one step at the row's defaults; 1 for rows that have none.
double iterations_of(const SolverRow& row);

/// Largest relative lengthening of a segment of a hair of 0.3 m that is let go horizontally, over `seconds`.
/// With the constants of hair where the row has any, else limp; without drag or style.
struct SwingSetup {
  uint32_t vertex_count = 32;
  double step_s = 1.0 / 60.0;
  double seconds = 5.0;
};
Result<double> swing_stretch(const SolverRow& row, const SwingSetup& setup, Executor& executor);

/// Strands of 0.25 m on a head.
Groom bench_groom(uint32_t strand_count, uint32_t vertex_count);

}  // namespace strandcast
