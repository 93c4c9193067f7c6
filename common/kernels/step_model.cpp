#include "common/kernels/step_model.h"

#include <algorithm>
#include <cmath>

namespace strandcast {
namespace {

/// As interpolate() of poses, without angles.
Pose between(const Pose& a, const Pose& b, double blend) {
  const double toward = glm::dot(a.rotation, b.rotation) < 0.0 ? -blend : blend;
  Pose pose;
  pose.position_m = a.position_m + blend * (b.position_m - a.position_m);
  pose.rotation = limited_rotation(a.rotation * (1.0 - blend) + b.rotation * toward);
  return pose;
}

/// The body during a share of a tick.
BodyInput body_of(const StepScene& scene, const StepTick& tick, double begin, double end) {
  BodyInput body = scene.body;
  const std::vector<glm::dvec3>& from = tick.body_before_m.empty() ? tick.body_m : tick.body_before_m;
  const auto at = [&](size_t point, double share) {
    return from[point] + share * (tick.body_m[point] - from[point]);
  };
  for (size_t i = 0; i < body.capsules.size(); ++i) {
    BodyCapsule& capsule = body.capsules[i];
    capsule.from_m = at(2 * i, end);
    capsule.to_m = at(2 * i + 1, end);
    capsule.from_before_m = at(2 * i, begin);
    capsule.to_before_m = at(2 * i + 1, begin);
  }
  body.is_new = tick.is_body_new && begin == 0.0;
  return body;
}

}  // namespace

const std::vector<StepKernel>& step_kernels() {
  using enum PlaneRole;
  static const std::vector<StepKernel> kernels = {
      {1, "sim/dftl.comp", 1.0},
      {2,
       "sim/direct_rod.comp",
       7.0,
       true,
       {VelocityChange, Displacement, RodAxis},
       {RodEdge, RodStrand},
       true,
       {7, 11}},
      {3, "sim/dftl_odd_even.comp", 6.0},
      {4, "sim/articulated.comp", 4.0},
      {5, "sim/angular_projection.comp", 9.0},
      {6, "sim/mass_spring.comp", 8.0},
      {7, "sim/mass_spring_altitude.comp", 8.0},
      {8, "sim/mass_spring_explicit.comp", 3.0},
      {9, "sim/pbd.comp", 7.0},
      {10, "sim/xpbd.comp", 13.0},
      {11, "sim/shape_constraints.comp", 4.0},
      {12, "sim/tractrix_emulation.comp", 7.0},
      {13, "sim/tractrix_hybrid.comp", 4.0},
      {14, "sim/tractrix_split.comp", 4.0, false, {Displacement}},
  };
  return kernels;
}

const StepKernel* find_step_kernel(const std::string& shader_path) {
  for (const StepKernel& kernel : step_kernels())
    if (kernel.shader_path == shader_path) return &kernel;
  return nullptr;
}

const StepKernel* find_step_kernel(uint8_t number) {
  for (const StepKernel& kernel : step_kernels())
    if (kernel.number == number) return &kernel;
  return nullptr;
}

float phase_of(const GustWave& wave, const glm::dvec3& mean_wind_mps, double time_s,
               const glm::dvec3& head_position_m) {
  const glm::dvec3 k = wave.wave_vector_rad_per_m;
  const double phase_rad = static_cast<double>(wave.phase_rad) + glm::dot(k, mean_wind_mps) * time_s -
                           glm::dot(k, head_position_m);
  return static_cast<float>(std::remainder(phase_rad, 2.0 * std::numbers::pi));
}

std::vector<SphereCollider> with_bust(const std::vector<SphereCollider>& colliders, const BustRig& rig,
                                      const BustTurn& turn) {
  std::vector<SphereCollider> moved = colliders;
  if (rig.exists() && turn != BustTurn(0.0))
    for (SphereCollider& sphere : moved)
      sphere.center_m = glm::vec3(with_bust(rig, turn, glm::dvec3(sphere.center_m)));
  return moved;
}

std::vector<StepInput> substeps_of(const StepScene& scene, const StepTick& tick, const Pose& from,
                                   double end_time_s) {
  const Pose begin = tick.carried_to.value_or(from);
  const auto count = static_cast<double>(scene.substeps);
  std::vector<StepInput> substeps(scene.substeps);
  Pose previous = begin;
  const BustTurn turn =
      scene.bust.exists() ? bust_turn(tick.bust, tick.world_from_head.rotation) : BustTurn(0.0);
  const BustTurn turn_before = tick.bust_before.value_or(turn);
  for (size_t i = 0; i < substeps.size(); ++i) {
    const double blend = static_cast<double>(i + 1) / count;
    const bool is_last = i + 1 == substeps.size();
    const Pose pose = is_last ? tick.world_from_head : between(begin, tick.world_from_head, blend);
    StepInput& substep = substeps[i];
    substep.renews_volume = renews_volume(i, substeps.size(), scene.step_s);
    substep.h_s = scene.step_s / count;
    substep.world_from_head_rotation = pose.rotation;
    substep.head_shift_m = pose.position_m - previous.position_m;
    substep.gravity_mps2 = scene.gravity_mps2;
    substep.groom_gravity_in_head_mps2 = scene.groom_gravity_in_head_mps2;
    substep.wind_mps = tick.wind_mps;
    substep.follicle_limit_rad = scene.follicle_limit_rad;
    substep.bust = {scene.bust, between(turn_before, turn, blend),
                    between(turn_before, turn, static_cast<double>(i) / count)};
    for (const SphereCollider& collider : with_bust(scene.colliders, scene.bust, substep.bust.turn))
      substep.colliders.push_back(
          {glm::vec3(pose.rotation * glm::dvec3(collider.center_m)), collider.radius_m});
    if (tick.has_body && tick.body_m.size() == 2 * scene.body.capsules.size())
      substep.body = body_of(scene, tick, static_cast<double>(i) / count, blend);
    if (tick.has_waves) {
      const double time_s = end_time_s - scene.step_s * (1.0 - blend);
      for (GustWave wave : scene.waves) {
        wave.phase_rad = phase_of(wave, scene.mean_wind_mps, time_s, pose.position_m);
        substep.gusts.push_back(wave);
      }
    }
    previous = pose;
  }
  return substeps;
}

}  // namespace strandcast
