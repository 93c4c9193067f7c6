// ReferenceSolver: common part of all double-precision solvers: state of the strands in double on the
// processor, load, read, write and rebase. A model defines how one strand steps, and its data besides the
// state. One thread; deliberately simple and slow.
#pragma once

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <span>
#include <vector>

#include "common/kernels/head_path.h"
#include "server/sim/solver.h"
#include "server/sim/strand_layout.h"

namespace strandcast {

/// Inputs of one substep that are the same for every strand, within the limits of strand_layout.h.
struct ReferenceStep {
  const StepInput* input = nullptr;
  double h_s = 0.0;
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};  // of the head, at the end
  glm::dquat carry{1.0, 0.0, 0.0, 0.0};     // turn of the head during the substep
  glm::dvec3 shift_m{0.0};
  glm::dvec3 head_velocity_mps{0.0};
  HeadPath before;
};

/// Returns whether a position or velocity is finite and of plausible size.
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

  /// Advances one strand: replaces its positions (head-relative world) and velocities (world) before the
  /// substep by those after it.
  virtual void step_strand(const ReferenceStep& step, uint32_t strand_index, std::span<glm::dvec3> position_m,
                           std::span<glm::dvec3> velocity_mps) = 0;
  /// Called after a groom was loaded; layout() and the state are valid.
  virtual void on_load() {}
  /// Called before the strands of a substep.
  virtual void on_step(const ReferenceStep&) {}
  /// Clears the history of a strand that was moved from outside.
  virtual void forget(uint32_t /*strand_index*/) {}
  /// Called when a strand was moved after its substep from `before_m` to position_m(); the model must move
  /// its stored displacements and segment directions along.
  virtual void go_along(uint32_t /*strand_index*/, std::span<const glm::dvec3> /*before_m*/) {}
  /// Rotates the model's data along with the state.
  virtual void turn_memory(const glm::dquat&) {}
  virtual uint64_t model_bytes() const { return 0; }

  const StrandLayout& layout() const { return layout_; }
  const HeadPath& head() const { return head_; }
  std::span<const glm::dvec3> position_m(uint32_t strand_index) const {
    return std::span(position_m_).subspan(size_t{strand_index} * layout_.vertex_count, layout_.vertex_count);
  }
  /// Returns whether no strand has moved since the groom was loaded.
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
