// StepTrail: what a simulation step was made of, as far as somebody else needs it to take the same step from
// a state of their own: the model, the scene, and the last ticks. It travels with snapshots, and the strand
// codec "step" predicts by it. Plain data, any thread.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/kernels/kernel_desc.h"
#include "common/kernels/plane_role.h"
#include "common/kernels/step_input.h"
#include "common/kernels/strand_passes.h"
#include "common/kernels/told_field.h"
#include "common/kernels/volume/volume_desc.h"
#include "common/math/pose.h"

namespace strandcast {

/// A strand kernel that others may run, by its number on the wire.
struct StepKernel {
  uint8_t number = 0;
  std::string shader_path;
  double cost = 1.0;  // of a step with default parameters, against that of dftl
  bool has_twist_variant = false;
  /// Planes of the model that change from step to step, and those that do not.
  std::vector<PlaneRole> moving = {};
  std::vector<PlaneRole> fixed = {};
  bool carries_way = false;  // Displacement is the way of the last substep, and RodAxis turns with segments
  std::array<uint32_t, 2> scratch_rows{};  // without and with twist
};
/// Numbers are given once and stay.
const std::vector<StepKernel>& step_kernels();
/// nullptr for one that nobody else runs.
const StepKernel* find_step_kernel(const std::string& shader_path);
const StepKernel* find_step_kernel(uint8_t number);

/// Which kernel moves the strands, with what. Heavy: it changes with the solver and its parameters only.
struct StepModel {
  KernelDesc kernel;
  StrandParameters parameters;
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;
  uint32_t pinned_root_count = 1;
  uint32_t pinned_tail_count = 0;
  std::vector<uint8_t>
      has_tail;  // (strand_count) 1 = those are pinned, 0 = its tip is free; empty: all alike
  // What the kernel reads besides, (rows x strand_count), strand fastest; empty where it has no such plane.
  std::vector<glm::vec4> rod_edge;    // (vertex_count x strand_count)
  std::vector<glm::vec4> rod_strand;  // (kRodStrandRows x strand_count)
  /// How strands act on each other; whether it is made anew in every step is not told.
  VolumeDesc volume;
  // What else acts on the strands; which body it is stands in the scene.
  std::optional<BendAngles> bend;
  double drag_along_share = 1.0;
  bool meets_body = false;
  std::shared_ptr<const ToldField> field;  // null: none

  bool has_free_tips() const { return !has_tail.empty() || pinned_tail_count == 0; }
  /// First vertex that is pinned at the tip of every strand.
  uint32_t free_end() const { return vertex_count - (has_tail.empty() ? pinned_tail_count : 0); }
  bool has_passes() const { return bend || drag_along_share != 1.0 || meets_body || field != nullptr; }
};
/// A volume that is finer is not told of: strands are predicted without it.
inline constexpr uint32_t kMostToldResolution = 64;
inline bool tells_volume(const StepModel& model) {
  return model.volume.acts() && model.volume.resolution <= kMostToldResolution;
}
inline constexpr uint32_t kRodStrandRows = 4;

/// What all ticks have in common until the scene changes.
struct StepScene {
  double step_s = 1.0 / 60.0;
  uint32_t substeps = 1;
  glm::dvec3 gravity_mps2{0.0, -9.81, 0.0};
  glm::dvec3 groom_gravity_in_head_mps2{0.0};
  double follicle_limit_rad = kFreeFollicleRad;
  float follicle_cosine = -1.0f;  // of that, from whoever made this: libraries differ in them
  float follicle_sine = 0.0f;
  std::vector<SphereCollider> colliders;  // head space, at rest
  BustRig bust;                           // that the colliders go along with
  glm::dvec3 mean_wind_mps{0.0};          // waves stand still in air that moves with it
  std::vector<GustWave> waves;            // at time 0 with the head at the origin
  /// Shape of the body; the positions of its capsules come with the ticks.
  BodyInput body;

  bool operator==(const StepScene&) const = default;
};
inline constexpr uint32_t kMaxSubsteps = 64;

/// One step of the simulation.
struct StepTick {
  uint64_t tick = 0;
  Pose world_from_head;  // at its end
  /// Pose of the head to which strands are moved rigidly before the first substep.
  std::optional<Pose> carried_to;
  glm::dvec3 wind_mps{0.0};  // mean wind at the head, world
  bool has_waves = false;
  /// Both ends of each capsule of the scene's body, head space; empty: where they are is not known.
  std::vector<glm::dvec3> body_m;         // at its end
  std::vector<glm::dvec3> body_before_m;  // at its beginning; empty: as at its end
  bool has_body = false;
  bool is_body_new = false;
  /// Rotation of the chest at the end of the tick; unchanged by default.
  BustCode bust = kRigidBust;
  std::optional<BustTurn> bust_before = {};
};
/// Ticks that a trail goes back, at most: what takes longer is no step any more.
inline constexpr size_t kMostTrailTicks = 8;

struct StepTrail {
  std::shared_ptr<const StepModel> model;
  std::shared_ptr<const StepScene> scene;
  std::vector<StepTick> ticks;  // successive ones, the newest last, no more than kMostTrailTicks
  /// SharedUpdate::number of the viewers' state from which the strands were stepped; 0 = none.
  uint64_t shared = 0;
};

/// Colliders of head space under this bust.
std::vector<SphereCollider> with_bust(const std::vector<SphereCollider>& colliders, const BustRig& rig,
                                      const BustTurn& turn);

/// The substeps of a tick that ends at `end_time_s` of simulated time, when the head was at `from` before.
/// Only + - * / and roots of doubles: the same bits on every machine.
std::vector<StepInput> substeps_of(const StepScene& scene, const StepTick& tick, const Pose& from,
                                   double end_time_s);

/// Phase of a wave at a time with the head there; |phase| <= pi. Waves stand still in air that moves with the
/// mean wind; a phase counts from the head.
float phase_of(const GustWave& wave, const glm::dvec3& mean_wind_mps, double time_s,
               const glm::dvec3& head_position_m);

}  // namespace strandcast
