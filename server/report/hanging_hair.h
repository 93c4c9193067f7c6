// Hair that hangs in the open without a head under it: what reports hold against theory. Plain functions, any
// thread.
#pragma once

#include "common/groom/groom.h"
#include "common/scene/scene_desc.h"

namespace strandcast {

inline constexpr double kEarthMps2 = 9.81;
inline constexpr float kHangingLengthM = 0.25f;
inline constexpr uint32_t kHangingVertices = 16;
inline constexpr uint32_t kHangingSeed = 1;
inline constexpr double kHangingHeightM = 1.6;  // of the roots, world

/// What acts on strands besides their model.
struct HairCompany {
  bool has_contact = false;  // friction and repulsion between strands
  bool has_air = false;
};
/// As it is when strands of full quality act on each other.
VolumeDesc volume_of(const HairCompany& company);

/// `direct_rod` without wind, colliders and a limit of its roots.
SceneDesc hanging_scene(double step_rate_hz);
/// `direct_rod` without stiffness and drag of its own: a chain.
SolverDesc limp_rod();
/// One straight hair that hangs from the head joint.
Groom make_hanging_hair(uint32_t vertex_count, float length_m);

}  // namespace strandcast
