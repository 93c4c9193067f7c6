// LaneProgram: one strand kernel with its constants over strands in blocks of 16 (strand_blocks.h), for one
// instruction set. Results are the same bits for every set and number of threads. From one thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <vector>

#include "common/base/worker_pool.h"
#include "common/kernels/kernel_desc.h"
#include "common/kernels/lane_kernel.h"
#include "common/kernels/plane_role.h"
#include "common/kernels/step_input.h"
#include "common/kernels/strand_blocks.h"
#include "common/simd/variants.h"

namespace strandcast {

/// Sets that this processor has and kernels were compiled for, the widest last; empty where there is none.
std::vector<simd::InstructionSet> lane_sets();
/// nullptr where no such kernel was compiled.
const LaneKernel* find_lane_kernel(const KernelDesc& desc, simd::InstructionSet set);

/// Blocks by role; nullptr = the kernel does not touch them.
using LanePlanes = std::array<StrandBlocks*, kPlaneRoleCount>;

/// Tables by role; none where the kernel looks nothing up.
using LaneTables = std::array<LaneTable, kTableRoleCount>;

/// What a program is for.
struct LaneWork {
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;
  bool has_colliders = false;  // what the scene lacks does not count, whatever a step says
  bool has_turbulence = false;
  WorkerPool* workers = nullptr;
  Priority priority = Priority::Simulation;
};

class LaneProgram {
 public:
  LaneProgram(const LaneKernel& kernel, const KernelDesc& desc, const LaneWork& work);
  /// Once for all strands.
  void run(const StepBlock& step, size_t collider_count, const LanePlanes& planes,
           const LaneTables& tables = {});
  /// Size of the program's own memory, mostly scratch.
  uint64_t size_bytes() const { return memory_bytes_ * most_workers_; }

 private:
  /// Zeroed memory of one worker.
  class Memory {
   public:
    explicit Memory(size_t size_bytes);
    std::byte* data() const { return bytes_.get(); }

   private:
    struct Free {
      void operator()(std::byte* bytes) const {
        ::operator delete (bytes, std::align_val_t{kBlockAlignment});
      }
    };
    std::unique_ptr<std::byte, Free> bytes_;
  };

  const LaneKernel& kernel_;
  const LaneWork work_;
  const ModelConstants names_;
  std::vector<LaneConstant> constants_;  // names point into names_
  const size_t kernel_bytes_;            // of a worker: the kernel's, then its scratch
  const size_t memory_bytes_;
  const uint32_t blocks_per_share_;
  const uint32_t most_workers_;
  std::vector<Memory> memory_;
};

}  // namespace strandcast
