// StepBuilder: turns the input at the end of a step into what each substep of the solver needs: head movement
// and turn, wind and gusts, colliders in head-relative world axes. Simulation thread; deterministic.
#pragma once

#include <optional>
#include <vector>

#include "common/kernels/step_model.h"
#include "common/motion/motion_clip.h"
#include "common/scene/features.h"
#include "common/scene/scene_desc.h"
#include "server/input/input_frame.h"
#include "server/scene/bust_follower.h"
#include "server/sim/solver.h"

namespace strandcast {

struct SceneStep {
  Pose world_from_head;             // at the end of the step
  std::vector<StepInput> substeps;  // scene.substeps of them
  /// Strands go along as they are to this rotation of the head (Solver::rebase) before the first substep: the
  /// head jumped, or inputs pass faster than the simulation. World from head.
  std::optional<glm::dquat> carried_to_rotation;
};

/// What part of the head's way in a step the strands feel; they go along as they are with the rest. 1 where
/// motion passes no faster than simulated time. Where `rate` times as much motion passes, 1 / rate^2: a step
/// stands for `rate` steps, and so large is the head's acceleration as it was (its speed is 1 / rate of what
/// it was, and changes in 1 / rate of the time). With the whole way it would be rate^2 times as large, and
/// hair stands on end.
double felt_share(double rate);

class StepBuilder {
 public:
  /// `colliders` in head space.
  StepBuilder(const SceneDesc& scene, std::vector<SphereCollider> colliders);

  /// Changed scene values; the head stays where it is.
  void change(const SceneDesc& scene, std::vector<SphereCollider> colliders);

  /// The neck that the head's colliders have; without one neck and chest are as the head is. Those that a
  /// scene lists itself go along with the head alone, and so does the bust then.
  void set_bust(const BustRig& rig) { bust_rig_ = rig; }

  /// The step that ends at `end_time_s` of simulated time: how the head moves, without wind and colliders.
  /// `input_rate`: time of the inputs since the last step per simulated time (InputClock).
  void begin(const InputFrame& input, double end_time_s, double input_rate = 1.0);
  // What the facts add to it.
  void add_wind();
  void add_gusts();
  void add_colliders();
  void add_follicle_limit();
  void add_body();
  /// Valid until the next begin().
  const SceneStep& step() const { return step_; }

  /// All of that; wind, gusts and the limit of the roots for these facts.
  const SceneStep& build(const InputFrame& input, const SceneFeatures& features, double end_time_s);

  /// The same as others need it who take the step too.
  StepScene step_scene(const SceneFeatures& features) const;
  StepTick step_tick(uint64_t tick) const;

  /// Joints that shapes of the body need and the input of the newest step does not have, a sentence for each.
  const std::vector<std::string>& missing_joints() const { return missing_joints_; }
  /// Places of the body's shapes at the end of the newest step.
  const std::vector<BodyCapsule>& body_capsules() const { return capsules_; }

  const Pose& world_from_head() const { return world_from_head_; }
  /// Of the chest at the end of the newest step.
  BustCode bust() const { return has_bust() ? bust_ : kRigidBust; }
  /// Of the head joint during the last substep of the newest step, world.
  glm::dvec3 head_velocity_mps() const;
  /// Gravity that the groom has its shape under, head space.
  const glm::dvec3& groom_gravity_in_head_mps2() const { return groom_gravity_in_head_mps2_; }

 private:
  bool has_bust() const { return bust_rig_.exists() && scene_.colliders.empty(); }
  void move_bust(const InputFrame& input, bool is_carried);

  SceneDesc scene_;
  // The groom is made for an upright head under the gravity that the scene begins with; later changes act on
  // it.
  glm::dvec3 groom_gravity_in_head_mps2_;
  std::vector<SphereCollider> colliders_;
  std::optional<GustGenerator> gust_generator_;
  std::vector<GustWave> waves_;  // at time 0 with the head at the origin
  Pose world_from_head_;
  BustRig bust_rig_;
  BustFollower bust_follower_;
  BustCode bust_ = kRigidBust;
  BustTurn bust_turn_{0.0};
  bool has_motion_ = false;
  std::vector<BodyCapsule> capsules_;  // as of the newest step
  std::vector<std::string> missing_joints_;
  bool is_body_new_ = true;  // its shapes are not those of the step before
  double felt_ = 1.0;        // of the step
  SceneStep step_;
  InputFrame input_;                         // of the step
  std::vector<double> end_time_s_;           // of each substep
  std::vector<glm::dvec3> head_position_m_;  // at the end of each substep, world
};

/// Waves that vary the wind over the size of a head: the part of the turbulence (von Karman, inertial range)
/// between their wavelengths, carried by the mean wind; each is divergence-free. Empty without gusts.
std::vector<GustWave> make_gust_waves(const WindDesc& wind);

}  // namespace strandcast
