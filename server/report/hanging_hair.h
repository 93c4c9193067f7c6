// Hair that hangs freely without a head, which reports compare with theory. Plain functions, any thread.
#pragma once

#include "common/groom/groom.h"
#include "common/scene/scene_desc.h"

namespace strandcast {

inline constexpr double kEarthMps2 = 9.81;
inline constexpr float kHangingLengthM = 0.25f;
inline constexpr uint32_t kHangingVertices = 16;
inline constexpr uint32_t kHangingSeed = 1;
inline constexpr double kHangingHeightM = 1.6;  // of the roots, world

/// Forces on strands besides those of their model.
struct HairCompany {
  bool has_contact = false;  // friction and repulsion between strands
  bool has_air = false;
};
/// Returns the volume description of strands of full quality with these forces.
VolumeDesc volume_of(const HairCompany& company);

/// Returns a scene with `direct_rod` without wind, colliders and root limit.
SceneDesc hanging_scene(double step_rate_hz);
/// Returns `direct_rod` without stiffness and drag, which is a chain.
SolverDesc limp_rod();
/// Makes one straight hair that hangs from the head joint.
Groom make_hanging_hair(uint32_t vertex_count, float length_m);

}  // namespace strandcast
