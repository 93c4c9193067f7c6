// StrandKernel: a GPU solver with one compute dispatch per substep. Used from one thread with its GL context
// current.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "server/sim/gpu_solver.h"

namespace strandcast {

/// What tells one kernel from another.
struct StrandKernelDesc {
  std::string name;         // labels
  std::string shader_path;  // below shaders/
  bool is_per_vertex =
      false;  // group = whole strands, one invocation per vertex; else one invocation per strand
  uint32_t local_size = 0;
  bool has_offset = false;  // a strand beside the state; one that is written starts without any
  ModelConstants constants;
};

class StrandKernel final : public GpuSolver {
 public:
  /// Unsupported or Internal when a needed variant does not compile.
  static Result<std::unique_ptr<Solver>> make(StrandKernelDesc desc, const StrandParameters& parameters,
                                              const GpuSolverContext& context);

 private:
  StrandKernel(StrandKernelDesc desc, const StrandParameters& parameters, const GpuSolverContext& context)
      : GpuSolver(context, parameters), desc_(std::move(desc)) {}

  Status compile(bool has_pinned_tail);
  uint32_t group_count() const;
  Status prepare() override;
  void run(const gl::Program& program) override;
  void forget(const std::vector<bool>& is_changed) override;
  void turn_memory(const glm::dquat& turn) override;
  const StrandPrograms& programs() const override { return programs_; }
  uint64_t model_bytes() const override { return offset_.size_bytes(); }

  StrandKernelDesc desc_;
  StrandPrograms programs_;
  bool is_compiled_for_tail_ = false;
  StrandPlane offset_;  // (vertex_count x strand_count) second strand less the state, m; has_offset only
};

}  // namespace strandcast
