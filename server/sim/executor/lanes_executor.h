// LanesExecutor: runs the strand kernels of shaders/sim on the processors without OpenGL. A strand is a lane
// of a vector register, and all threads work on blocks of 16 strands. The kernels are the same GLSL, compiled
// as C++ (lane_kernel.h). All instruction sets and numbers of threads give the same bits; OpenGL's differ by
// rounding.
#pragma once

#include <memory>

#include "common/base/worker_pool.h"
#include "common/kernels/lane_program.h"
#include "server/sim/executor/executor.h"

namespace strandcast {

struct LaneOptions {
  simd::InstructionSet set;
  WorkerPool* workers = nullptr;  // outlives the executor; nullptr: the process's
};

/// Makes the executor with the best instruction set. Unavailable if no kernel was compiled for this
/// processor.
Result<std::unique_ptr<Executor>> make_lanes_executor();
/// Makes the executor; `options.set` must be one of lane_sets().
std::unique_ptr<Executor> make_lanes_executor(const LaneOptions& options);

}  // namespace strandcast
