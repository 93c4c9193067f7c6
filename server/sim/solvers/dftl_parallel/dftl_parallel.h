// Odd-even Dynamic Follow-The-Leader: every vertex at once, odd and even ones in turn, a few iterations, then
// a finish that restores exact lengths. Source: document 003, section 4.2.3 (optimised_gpu version); the
// finish is ours.
#pragma once

#include "server/sim/solver_registry.h"

namespace strandcast {

inline constexpr uint32_t kDefaultOddEvenIterations = 5;  // 003 section 4.2.3: looks like the serial form
inline constexpr uint32_t kMaxOddEvenIterations = 64;

SolverRow dftl_parallel_row();

Result<std::unique_ptr<Solver>> make_dftl_parallel_gpu(const SolverParameters& parameters,
                                                       const GpuSolverContext& context);
std::unique_ptr<Solver> make_dftl_parallel_reference(const SolverParameters& parameters);

}  // namespace strandcast
