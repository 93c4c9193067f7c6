// ReferenceSolver: what all double-precision solvers share around their equations: the strands' state in
// double on the processor, load, read, write and rebase. A model says how one strand steps, and what it keeps
// beside the state. One thread; slow on purpose.
#pragma once

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <span>
#include <vector>

#include "common/kernels/head_path.h"
#include "server/sim/solver.h"
#include "server/sim/strand_layout.h"

namespace strandcast {

/// One substep as every strand sees it, within the limits of strand_layout.h.
struct ReferenceStep {
  const StepInput* input = nullptr;
  double h_s = 0.0;
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};  // of the head, at the end
  glm::dquat carry{1.0, 0.0, 0.0, 0.0};     // turn of the head during the substep
  glm::dvec3 shift_m{0.0};
  glm::dvec3 head_velocity_mps{0.0};
  HeadPath before;
};

/// A position or velocity that is a number of this world.
bool is_sane(const glm::dvec3& value);

class ReferenceSolver : public Solver {
 public:
  Status load(const Groom& groom, const glm::dquat& world_from_head_rotation) final;
  void substep(const StepInput& input) final;
  void read(SolverState& state) final;
  void write(const SolverState& state) final;
  void rebase(const glm::dquat& world_from_head_rotation) final;
  uint32_t strand_count() const final { return layout_.strand_count; }
  uint64_t memory_bytes() const final;

 protected:
  explicit ReferenceSolver(uint32_t most_vertices = kMaxVertexCount) : most_vertices_(most_vertices) {}

  /// Of one strand, a vertex each: position (head-relative world) and velocity (world) before the substep are
  /// replaced by those after it.
  virtual void step_strand(const ReferenceStep& step, uint32_t strand_index, std::span<glm::dvec3> position_m,
                           std::span<glm::dvec3> velocity_mps) = 0;
  /// A groom was loaded: layout() and the state are known.
  virtual void on_load() {}
  /// Before the strands of a substep.
  virtual void on_step(const ReferenceStep&) {}
  /// The strand was put somewhere else: what is kept of its past goes.
  virtual void forget(uint32_t /*strand_index*/) {}
  /// After its substep the strand was moved from here to position_m(): what is kept of its way and of its
  /// segments' directions goes along.
  virtual void go_along(uint32_t /*strand_index*/, std::span<const glm::dvec3> /*before_m*/) {}
  /// What is kept beside the state turns with it.
  virtual void turn_memory(const glm::dquat&) {}
  virtual uint64_t model_bytes() const { return 0; }

  const StrandLayout& layout() const { return layout_; }
  const HeadPath& head() const { return head_; }
  std::span<const glm::dvec3> position_m(uint32_t strand_index) const {
    return std::span(position_m_).subspan(size_t{strand_index} * layout_.vertex_count, layout_.vertex_count);
  }
  /// As loaded: nothing moved a strand since.
  bool is_at_rest() const { return is_at_rest_; }

 private:
  void hold_roots(const ReferenceStep& step);

  uint32_t most_vertices_;
  StrandLayout layout_;
  HeadPath head_;
  bool is_at_rest_ = true;
  // (strand_count x vertex_count)
  std::vector<glm::dvec3> position_m_;
  std::vector<glm::dvec3> velocity_mps_;
  std::vector<glm::dvec3> unheld_m_;  // of the strand in progress
};

}  // namespace strandcast
