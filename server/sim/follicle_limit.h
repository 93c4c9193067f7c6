// FollicleLimit: the pass that holds roots after each substep of whatever model's kernel ran
// (shaders/sim/follicle_limit.comp). A strand leans from its groomed direction only as far as a follicle lets
// it; what hangs on its first free segment goes along. Strands whose tip is held too are left alone: their
// lengths could not be kept. From the thread of its executor.
#pragma once

#include <memory>

#include "server/sim/executor/executor.h"
#include "server/sim/solver.h"
#include "server/sim/strand_layout.h"

namespace strandcast {

/// Planes of a model that go along with strands that are moved, where it has them; null = it has none.
struct CarriedPlanes {
  StrandPlane* way = nullptr;   // of every vertex in the last substep; world, m
  StrandPlane* axis = nullptr;  // of every segment; world. Only with `way`

  int memory() const { return pass_memory(way != nullptr, axis != nullptr); }
};

class FollicleLimit {
 public:
  /// As Executor::make_program().
  static Result<FollicleLimit> make(Executor& executor, const SceneFeatures& features,
                                    const StrandLayout& layout, const CarriedPlanes& carried);

  /// Whether this substep's strands are held: the input has a limit, and the strands have free tips.
  static bool holds(const StepInput& input, const StrandLayout& layout);
  /// `strands`: the planes of the state.
  void run(const StepBlock& step, size_t collider_count, BoundPlanes strands, const CarriedPlanes& carried);
  uint64_t size_bytes() const { return program_->size_bytes(); }

 private:
  std::unique_ptr<KernelProgram> program_;
};

}  // namespace strandcast
