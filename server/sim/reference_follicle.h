// What the double-precision solvers do about roots that lean too far. Written from the geometry, without a
// line in common with shaders/sim/follicle_limit.comp.
#pragma once

#include <glm/glm.hpp>
#include <span>

#include "server/sim/strand_layout.h"

namespace strandcast {

/// One strand after its substep, seen from its follicle.
struct ReferenceRoot {
  glm::dvec3 groomed{0.0};             // first free segment as groomed, turned with the head
  glm::dvec3 follicle_mps{0.0};        // velocity of the follicle's cone at the segment's end
  double h_s = 0.0;                    // of the substep
  uint32_t first = 1;                  // free vertex
  std::span<glm::dvec3> position_m;    // head-relative world axes
  std::span<glm::dvec3> velocity_mps;  // world
};

/// Angle between two directions, 0 .. pi; 0 when one has no length.
double angle_rad(const glm::dvec3& a, const glm::dvec3& b);

/// Turns the first free segment back to the input's limit, or as much further as colliders ask for that the
/// groomed direction is outside of; all vertices beyond go along, around colliders. Takes from the velocity
/// of the segment's end what drives it out of the cone; the strand's own tensions tell the vertices beyond.
/// False when nothing had to move.
bool hold_root(const StepInput& input, const ReferenceRoot& root);

}  // namespace strandcast
