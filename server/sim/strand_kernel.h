// StrandKernel: a solver that runs one kernel per substep. Runs on its executor's thread.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "server/sim/kernel_solver.h"

namespace strandcast {

/// Properties that distinguish one kernel from another.
struct StrandKernelDesc {
  std::string name;            // labels
  std::string shader_path;     // below shaders/
  bool is_per_vertex = false;  // as KernelDesc
  bool has_offset = false;     // a strand beside the state; one that is written starts without any
  ModelConstants constants;
};

class StrandKernel final : public KernelSolver {
 public:
  static std::unique_ptr<Solver> make(StrandKernelDesc desc, const StrandParameters& parameters,
                                      const SolverContext& context) {
    return std::unique_ptr<Solver>(new StrandKernel(std::move(desc), parameters, context));
  }

 private:
  StrandKernel(StrandKernelDesc desc, const StrandParameters& parameters, const SolverContext& context)
      : KernelSolver(context, parameters), desc_(std::move(desc)) {}

  void prepare() override;
  KernelDesc kernel() const override;
  void bind(BoundPlanes& planes) const override;
  void forget(const std::vector<bool>& is_changed) override;
  void turn_memory(const glm::dquat& turn) override;
  uint64_t model_bytes() const override { return offset_ ? offset_->size_bytes() : 0; }

  StrandKernelDesc desc_;
  // (vertex_count x strand_count) second strand less the state, m; has_offset only
  std::unique_ptr<StrandPlane> offset_;
};

}  // namespace strandcast
