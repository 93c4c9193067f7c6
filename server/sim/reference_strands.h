// ReferenceStrands: common part of the double-precision solvers with explicit forces, which place vertices
// one after another. Written from the equations, without sharing code with the shaders.
#pragma once

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <span>
#include <vector>

#include "server/sim/reference_solver.h"
#include "server/sim/strand_parameters.h"

namespace strandcast {

/// One strand during one substep, in head-relative world axes, in the frame of the moving head joint.
struct ReferenceStrand {
  uint32_t index = 0;
  std::vector<glm::dvec3> target_m;      // groomed shape, turned with the head
  std::vector<glm::dvec3> old_m;         // position before the substep, as stored then
  std::vector<glm::dvec3> predicted_m;   // where forces alone would take it
  std::vector<glm::dvec3> placed_m;      // after the constraints
  std::vector<glm::dvec3> pushed_m;      // of that way, what colliders and their friction did
  std::vector<glm::dvec3> velocity_mps;  // before the substep, relative to the head joint's during it
  std::vector<double> inertia;           // 1 + what drag and pull add in an implicit step
  std::vector<double> segment_m;         // before vertex i
  std::vector<bool> is_intact;           // its state before the substep was of this world
  std::span<double> memory;              // of the model; kept between substeps, 0 at first
};

class ReferenceStrands : public ReferenceSolver {
 protected:
  explicit ReferenceStrands(const StrandParameters& parameters) : parameters_(parameters) {}

  /// Moves placed_m of all vertices that are not pinned, by place() or rigidly with their segment.
  virtual void solve(ReferenceStrand& strand) const = 0;

  /// Returns how many numbers the model stores per strand besides positions and velocities; they start at 0.
  virtual size_t memory_size() const { return 0; }
  std::span<double> memory_of(uint32_t strand_index);
  /// Called after a groom was loaded; layout() is valid.
  virtual void prepare() {}

  /// Places vertex i as close to its prediction as possible at its segment's length from vertex i-1, outside
  /// of colliders and within the reach of a pinned tail.
  void place(ReferenceStrand& strand, uint32_t i) const;
  /// Returns where forces alone move vertex i from old_m.
  virtual glm::dvec3 predict(const ReferenceStrand& strand, uint32_t i) const;
  /// Returns the displacement from which the velocity of vertex i is computed.
  virtual glm::dvec3 way_m(const ReferenceStrand& strand, uint32_t i) const {
    return strand.placed_m[i] - strand.old_m[i];
  }
  const StrandParameters& parameters() const { return parameters_; }
  // Of the substep in progress.
  const StepInput& input() const { return *step_.input; }
  double h_s() const { return step_.h_s; }
  glm::dquat rotation() const { return step_.rotation; }           // of the head, at the end
  uint32_t step_index() const { return step_.before.step_index; }  // since load()
  glm::dquat carry() const { return step_.carry; }                 // turn of the head
  glm::dvec3 head_velocity_mps() const { return step_.head_velocity_mps; }
  /// Returns the velocity, due to the head's rotation in the previous substep, of a point at `arm_m` from
  /// another.
  glm::dvec3 previous_turn_mps(const glm::dvec3& arm_m) const { return step_.before.turn_per_s * arm_m; }
  /// Returns whether the state of vertex i before the substep was finite and plausible.
  bool was_intact(const ReferenceStrand& strand, uint32_t i) const { return strand.is_intact[i]; }
  /// Thickness of this strand relative to the mean, and the drag that follows from it.
  double thickness(const ReferenceStrand& strand) const;
  double air_drag_per_s(const ReferenceStrand& strand) const;
  /// Pull to the groomed shape, 1/s^2, and the part of gravity that remains when the pull carries its share.
  double style_stiffness_per_s2(const ReferenceStrand& strand, uint32_t i) const;
  glm::dvec3 uncarried_gravity_mps2(const ReferenceStrand& strand, uint32_t i) const;
  /// Velocity gained as the pull is that a little after the substep (pull_ahead_s), or before its end.
  glm::dvec3 pulled_on_mps(const ReferenceStrand& strand, uint32_t i) const;
  bool is_pinned(uint32_t i) const { return i < layout().pinned_root_count || i >= layout().tail_begin(); }

 private:
  void on_load() final;
  void on_step(const ReferenceStep& step) final { step_ = step; }
  void step_strand(const ReferenceStep& step, uint32_t strand_index, std::span<glm::dvec3> position_m,
                   std::span<glm::dvec3> velocity_mps) final;
  void forget(uint32_t strand_index) final;
  uint64_t model_bytes() const final { return memory_.size() * sizeof(double); }
  void begin(ReferenceStrand& strand, std::span<const glm::dvec3> position_m,
             std::span<const glm::dvec3> velocity_mps);
  glm::dvec3 finish_velocity(const ReferenceStrand& strand, uint32_t i) const;

  StrandParameters parameters_;
  std::vector<double> memory_;
  ReferenceStep step_;  // in progress
  ReferenceStrand scratch_;
};

}  // namespace strandcast
