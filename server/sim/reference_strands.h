// ReferenceStrands: the parts that the double-precision reference solvers share. Written from the equations,
// vertex by vertex on one thread, without a line in common with the shaders; slow on purpose.
#pragma once

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <span>
#include <vector>

#include "server/sim/solver.h"
#include "server/sim/strand_layout.h"
#include "server/sim/strand_parameters.h"

namespace strandcast {

/// One strand during one substep, in head-relative world axes, seen from the moving head joint.
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
  std::span<double> memory;              // of the model; kept between substeps, 0 at first
};

class ReferenceStrands : public Solver {
 public:
  Status load(const Groom& groom, const glm::dquat& world_from_head) final;
  void substep(const StepInput& input) final;
  void read(SolverState& state) final;
  void write(const SolverState& state) final;
  uint64_t memory_bytes() const final;

 protected:
  explicit ReferenceStrands(const StrandParameters& parameters) : parameters_(parameters) {}

  /// Moves placed_m of all vertices that are not pinned, by place() or rigidly with their segment.
  virtual void solve(ReferenceStrand& strand) const = 0;

  /// Numbers that the model keeps per strand besides positions and velocities; they start from 0.
  virtual size_t memory_size() const { return 0; }
  /// A groom was loaded: layout() is known.
  virtual void on_load() {}

  /// Puts vertex i as near to its prediction as its segment's length from vertex i-1, the colliders and the
  /// reach of a pinned tail allow. pinned tail.
  void place(ReferenceStrand& strand, uint32_t i) const;
  /// Where forces alone take vertex i from old_m.
  virtual glm::dvec3 predict(const ReferenceStrand& strand, uint32_t i) const;
  /// The way that vertex i's velocity is made of.
  virtual glm::dvec3 way_m(const ReferenceStrand& strand, uint32_t i) const {
    return strand.placed_m[i] - strand.old_m[i];
  }
  const StrandParameters& parameters() const { return parameters_; }
  const StrandLayout& layout() const { return layout_; }
  // Of the substep in progress.
  const StepInput& input() const { return *input_; }
  double h_s() const { return h_s_; }
  glm::dquat rotation() const { return rotation_; }    // of the head, at the end
  uint32_t step_index() const { return step_index_; }  // since load()
  glm::dquat carry() const { return rotation_ * glm::conjugate(previous_rotation_); }  // turn of the head
  glm::dvec3 head_velocity_mps() const { return head_velocity_mps_; }
  /// Velocity of a point at `arm_m` from another by the head's turn in the substep before.
  glm::dvec3 previous_turn_mps(const glm::dvec3& arm_m) const;
  /// Whether the state of vertex i before the substep was finite and of this world.
  bool was_intact(const ReferenceStrand& strand, uint32_t i) const;
  /// Of this strand, over the mean; and the drag that goes with it.
  double thickness(const ReferenceStrand& strand) const;
  double air_drag_per_s(const ReferenceStrand& strand) const;
  /// Pull to the groomed shape, 1/s^2, and what is left of gravity when it carries its share.
  double style_stiffness_per_s2(const ReferenceStrand& strand, uint32_t i) const;
  glm::dvec3 uncarried_gravity_mps2(const ReferenceStrand& strand, uint32_t i) const;
  bool is_pinned(uint32_t i) const { return i < layout_.pinned_root_count || i >= layout_.tail_begin(); }

 private:
  void begin(ReferenceStrand& strand, uint32_t strand_index);
  std::span<double> memory_of(uint32_t strand_index);
  glm::dvec3 finish_velocity(const ReferenceStrand& strand, uint32_t i) const;

  StrandParameters parameters_;
  StrandLayout layout_;
  std::vector<glm::dvec3> position_m_;
  std::vector<glm::dvec3> velocity_mps_;
  std::vector<double> memory_;
  glm::dquat previous_rotation_{1.0, 0.0, 0.0, 0.0};
  glm::dquat previous_carry_{1.0, 0.0, 0.0, 0.0};
  double previous_h_s_ = 1.0;

  // The substep in progress, within the limits of strand_layout.h.
  const StepInput* input_ = nullptr;
  double h_s_ = 0.0;
  uint32_t step_index_ = 0;
  glm::dquat rotation_{1.0, 0.0, 0.0, 0.0};
  glm::dvec3 head_velocity_mps_{0.0};
  ReferenceStrand scratch_;
};

}  // namespace strandcast
