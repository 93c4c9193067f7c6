// What the double-precision reference solvers do about colliders and moving air. Written from the equations,
// without a line in common with the shaders.
#pragma once

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <optional>

#include "server/sim/solver.h"

namespace strandcast {

inline constexpr double kTinyLengthM = 1e-10;
/// Rounds of answers to a field or a body: two, and more where so much is left.
inline constexpr int kMostRounds = 5;
inline constexpr double kResidueM = 5e-5;
/// An end that the middle's turn moved by more than twice this may have met something else.
inline constexpr double kLookAgainM = 2e-4;

/// A collider as the solvers take it, within the limits of strand_layout.h.
struct ReferenceSphere {
  glm::dvec3 center_m{0.0};
  double radius_m = 0.0;
};
size_t sphere_count(const StepInput& input);
ReferenceSphere sphere_of(const StepInput& input, size_t index);

/// The sphere that the point is deepest inside of, by r^2 - d^2; its radius is 0 when the point is in none.
ReferenceSphere deepest_sphere(const StepInput& input, const glm::dvec3& point_m);

/// Times a point inside several colliders is pushed, out of the deepest first.
int push_rounds(const StepInput& input);

/// What strands touch in a substep: colliders where they are at its end, on a skin that turns with the head,
/// and where the bust is with the chest.
struct ReferenceSkin {
  const StepInput& input;
  glm::dquat carry{1.0, 0.0, 0.0, 0.0};  // turn of the head during the substep
  double friction = 0.0;                 // Coulomb coefficient

  /// Where a place of the skin is at the end that was at `old_m` before the substep.
  glm::dvec3 carried(const glm::dvec3& old_m) const;
  /// Where it is at the end; `groomed_m` is turned with the head alone.
  glm::dvec3 on_bust(const glm::dvec3& groomed_m) const;
};

/// Coulomb friction in displacements: sliding over the skin is undone up to the friction coefficient times
/// the depth that the collider has to push back. The point was at `old_m` before the substep.
glm::dvec3 held_by_friction(const ReferenceSkin& skin, const glm::dvec3& old_m, const glm::dvec3& point_m,
                            const ReferenceSphere& sphere);

/// A segment's end, moved by a collider.
struct ReferenceSegment {
  glm::dvec3 old_m{0.0};  // of the end, before the substep
  glm::dvec3 start_m{0.0};
  glm::dvec3 end_m{0.0};
  double length_m = 0.0;
  /// Where the end may stay, inside of a sphere or not; turned with the head alone.
  std::optional<glm::dvec3> groomed_m = {};
};

/// The end turned about the start until it is outside all spheres (two rounds, out of the deepest first) and
/// held by Coulomb friction.
glm::dvec3 pushed_out(const ReferenceSkin& skin, ReferenceSegment segment);

/// Turns a segment about its start until its end lies on the sphere (center, radius): both equations of 003
/// figure 4.1 at once. The nearest end that can be had when the two spheres do not meet.
glm::dvec3 turned_onto_sphere(const ReferenceSegment& segment, const glm::dvec3& center, double radius);

/// Wind and gusts at a point relative to the head joint, within the limits of strand_layout.h.
glm::dvec3 air_velocity_mps(const StepInput& input, const glm::dvec3& point_m);

/// The vector, no longer than `longest`.
glm::dvec3 shortened(const glm::dvec3& value, double longest);

}  // namespace strandcast
