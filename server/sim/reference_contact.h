// What the double-precision reference solvers do about colliders and moving air. Written from the equations,
// without a line in common with the shaders.
#pragma once

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

#include "server/sim/solver.h"

namespace strandcast {

/// A segment's end, moved by a collider.
struct ReferenceSegment {
  glm::dvec3 old_m{0.0};  // of the end, before the substep
  glm::dvec3 start_m{0.0};
  glm::dvec3 end_m{0.0};
  double length_m = 0.0;
};

/// The end turned about the start until it is outside all spheres (two rounds, out of the deepest first) and
/// held by Coulomb friction; `carry` is the turn of the head during the substep.
glm::dvec3 pushed_out(const StepInput& input, const glm::dquat& carry, double friction,
                      ReferenceSegment segment);

/// Turns a segment about its start until its end lies on the sphere (center, radius): both equations of 003
/// figure 4.1 at once. The nearest end that can be had when the two spheres do not meet.
glm::dvec3 turned_onto_sphere(const ReferenceSegment& segment, const glm::dvec3& center, double radius);

/// Wind and gusts at a point relative to the head joint, within the limits of strand_layout.h.
glm::dvec3 air_velocity_mps(const StepInput& input, const glm::dvec3& point_m);

/// The vector, no longer than `longest`.
glm::dvec3 shortened(const glm::dvec3& value, double longest);

}  // namespace strandcast
