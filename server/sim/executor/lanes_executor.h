// LanesExecutor: runs the strand kernels of shaders/sim on the processors, a strand per lane of a vector
// register and blocks of 16 strands side by side on all threads, without OpenGL. The kernels are the same
// GLSL, compiled as C++ (lane_kernel.h). Results are the same bits for every instruction set and number of
// threads; those of OpenGL differ from them by roundings.
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

/// Unavailable when no kernel was compiled for what this processor has.
Result<std::unique_ptr<Executor>> make_lanes_executor();
/// `options.set` is one of lane_sets().
std::unique_ptr<Executor> make_lanes_executor(const LaneOptions& options);

}  // namespace strandcast
