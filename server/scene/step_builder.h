// StepBuilder: computes the inputs of each substep of the solver from the input at the end of a step: head
// motion, wind, gusts, and colliders in head-relative world axes. Simulation thread; deterministic.
#pragma once

#include <optional>
#include <vector>

#include "common/kernels/step_model.h"
#include "common/motion/motion_clip.h"
#include "common/scene/features.h"
#include "common/scene/scene_desc.h"
#include "server/input/input_frame.h"
#include "server/scene/bust_follower.h"
#include "server/scene/felt_motion.h"
#include "server/sim/solver.h"

namespace strandcast {

struct SceneStep {
  Pose world_from_head;             // at the end of the step
  std::vector<StepInput> substeps;  // scene.substeps of them
  /// Rotation of the head (world from head) to which strands are carried rigidly (Solver::rebase()) before
  /// the first substep. Set if the head jumped, in the second after a cut that changed its speed, or if
  /// inputs pass faster than the simulation.
  std::optional<glm::dquat> carried_to_rotation;
};

class StepBuilder {
 public:
  /// Starts with a scene; `colliders` are in head space.
  StepBuilder(const SceneDesc& scene, std::vector<SphereCollider> colliders);

  /// Takes changed scene values; the head stays where it is.
  void change(const SceneDesc& scene, std::vector<SphereCollider> colliders);

  /// Sets the neck that moves the head's own colliders. Without one, and with colliders that the scene lists,
  /// everything moves rigidly with the head.
  void set_bust(const BustRig& rig) { bust_rig_ = rig; }

  /// Begins the step that ends at `end_time_s` of simulated time: computes the head's motion, without wind
  /// and colliders. `input_rate`: input time per simulated time (InputClock).
  void begin(const InputFrame& input, double end_time_s, double input_rate = 1.0);
  // What the facts add to it.
  void add_wind();
  void add_gusts();
  void add_colliders();
  void add_follicle_limit();
  void add_body();
  /// Returns the step; valid until the next begin().
  const SceneStep& step() const { return step_; }

  /// Begins and completes a step: adds wind, gusts and the root limit that these facts require.
  const SceneStep& build(const InputFrame& input, const SceneFeatures& features, double end_time_s);

  /// Returns the newest step as decoders need it to simulate the same: its scene, and its tick.
  StepScene step_scene(const SceneFeatures& features) const;
  StepTick step_tick(uint64_t tick) const;

  /// Returns a sentence for each joint that the body's shapes need and the newest input lacks.
  const std::vector<std::string>& missing_joints() const { return missing_joints_; }
  /// Returns the body's capsules at the end of the newest step.
  const std::vector<BodyCapsule>& body_capsules() const { return capsules_; }

  const Pose& world_from_head() const { return world_from_head_; }
  /// Returns the pose of the chest at the end of the newest step.
  BustCode bust() const { return has_bust() ? bust_ : kRigidBust; }
  /// Returns the velocity of the head joint during the last substep of the newest step, world.
  glm::dvec3 head_velocity_mps() const;
  /// Returns the gravity under which the groom has its shape, in head space.
  const glm::dvec3& groom_gravity_in_head_mps2() const { return groom_gravity_in_head_mps2_; }

 private:
  bool has_bust() const { return bust_rig_.exists() && scene_.colliders.empty(); }
  Pose place_before(const Pose& target, bool has_jumped, double rate);
  void move_bust(const InputFrame& input, bool has_jumped);

  SceneDesc scene_;
  // The groom is made for an upright head under the gravity that the scene begins with; later changes act on
  // it.
  glm::dvec3 groom_gravity_in_head_mps2_;
  std::vector<SphereCollider> colliders_;
  std::optional<GustGenerator> gust_generator_;
  std::vector<GustWave> waves_;  // at time 0 with the head at the origin
  Pose world_from_head_;
  FeltMotion felt_motion_;
  BustRig bust_rig_;
  BustFollower bust_follower_;
  BustCode bust_ = kRigidBust;
  BustTurn bust_turn_{0.0};
  bool has_motion_ = false;
  std::vector<BodyCapsule> capsules_;  // as of the newest step
  std::vector<std::string> missing_joints_;
  bool is_body_new_ = true;  // its shapes are not those of the step before
  double felt_ = 1.0;        // share of the step's motion, by its pace
  SceneStep step_;
  InputFrame input_;                         // of the step
  std::vector<double> end_time_s_;           // of each substep
  std::vector<glm::dvec3> head_position_m_;  // at the end of each substep, world
};

/// Makes waves that vary the wind over the size of a head: the turbulence (von Karman, inertial range)
/// between their wavelengths, carried by the mean wind. Each wave is divergence-free. Empty without gusts.
std::vector<GustWave> make_gust_waves(const WindDesc& wind);

}  // namespace strandcast
