// Odd-even Dynamic Follow-The-Leader: every vertex at once, odd and even ones in turn, a few iterations.
// Source: Woodhouse 2017, 4.2.3 (optimised_gpu version), which leaves open where the iterations start
// and what a placement starts from. Here they start from the predicted directions laid end to end with exact
// lengths. Every placement starts again from the prediction: two more vertices per strand are final after
// each iteration, and half as many iterations as vertices give the serial result. A finish lays the segments
// end to end once more.
#pragma once

#include "server/sim/solver_registry.h"

namespace strandcast {

inline constexpr uint32_t kDefaultOddEvenIterations = 5;  // Woodhouse 2017, 4.2.3: looks like the serial form
inline constexpr uint32_t kMaxOddEvenIterations = 64;

SolverRow dftl_parallel_row();

Result<std::unique_ptr<Solver>> make_dftl_parallel(const SolverParameters& parameters,
                                                   const SolverContext& context);
std::unique_ptr<Solver> make_dftl_parallel_reference(const SolverParameters& parameters);

}  // namespace strandcast
