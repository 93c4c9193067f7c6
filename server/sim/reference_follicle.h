// Limits the lean of roots for the double-precision solvers. Written from the geometry, without sharing code
// with shaders/sim/follicle_limit.comp.
#pragma once

#include <glm/glm.hpp>
#include <span>

#include "server/sim/strand_layout.h"

namespace strandcast {

/// One strand after its substep, relative to its follicle.
struct ReferenceRoot {
  glm::dvec3 groomed{0.0};             // first free segment as groomed, turned with the head
  glm::dvec3 follicle_mps{0.0};        // velocity of the follicle's cone at the segment's end
  double h_s = 0.0;                    // of the substep
  uint32_t first = 1;                  // free vertex
  std::span<glm::dvec3> position_m;    // head-relative world axes
  std::span<glm::dvec3> velocity_mps;  // world
};

/// Returns the angle between two directions, 0 .. pi; 0 if one has no length.
double angle_rad(const glm::dvec3& a, const glm::dvec3& b);

/// Rotates the first free segment back to the input's limit, or farther if colliders require it and the
/// groomed direction is outside of them. All vertices beyond move along, around colliders. Removes the
/// velocity of the segment's end out of the cone; vertices beyond are corrected through the strand's tension.
/// Returns false if nothing had to move.
bool hold_root(const StepInput& input, const ReferenceRoot& root);

}  // namespace strandcast
