// Collisions and moving air of the double-precision reference solvers. Written from the equations, without
// sharing code with the shaders.
#pragma once

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <optional>

#include "server/sim/solver.h"

namespace strandcast {

inline constexpr double kTinyLengthM = 1e-10;
/// Number of rounds of resolving contacts with a field or body, at most. With a body at least two, and more
/// while this much penetration remains.
inline constexpr int kMostRounds = 5;
inline constexpr double kResidueM = 5e-5;
/// Displacement beyond which an end moved by the middle's rotation is checked again; it may have met
/// something else at twice this distance.
inline constexpr double kLookAgainM = 2e-4;

/// A collider as the solvers use it, within the limits of strand_layout.h.
struct ReferenceSphere {
  glm::dvec3 center_m{0.0};
  double radius_m = 0.0;
};
size_t sphere_count(const StepInput& input);
ReferenceSphere sphere_of(const StepInput& input, size_t index);

/// Returns the sphere that contains the point most deeply, by r^2 - d^2; its radius is 0 if none does.
ReferenceSphere deepest_sphere(const StepInput& input, const glm::dvec3& point_m);

/// Returns how often a point inside several colliders is pushed, each time out of the deepest.
int push_rounds(const StepInput& input);

/// Surface that strands touch in a substep: the colliders at its end, on a skin that turns with the head, and
/// with the chest where the bust is.
struct ReferenceSkin {
  const StepInput& input;
  glm::dquat carry{1.0, 0.0, 0.0, 0.0};  // turn of the head during the substep
  double friction = 0.0;                 // Coulomb coefficient

  /// Returns where the place of the skin that was at `old_m` before the substep is at its end.
  glm::dvec3 carried(const glm::dvec3& old_m) const;
  /// Returns where a groomed place is at the end; `groomed_m` is turned with the head alone.
  glm::dvec3 on_bust(const glm::dvec3& groomed_m) const;
};

/// Applies Coulomb friction to a displacement. Sliding over the skin is undone up to the friction coefficient
/// times the penetration depth. `old_m` is the point before the substep.
glm::dvec3 held_by_friction(const ReferenceSkin& skin, const glm::dvec3& old_m, const glm::dvec3& point_m,
                            const ReferenceSphere& sphere);

/// A segment whose end a collider moves.
struct ReferenceSegment {
  glm::dvec3 old_m{0.0};  // of the end, before the substep
  glm::dvec3 start_m{0.0};
  glm::dvec3 end_m{0.0};
  double length_m = 0.0;
  /// Where the end may stay, inside of a sphere or not; turned with the head alone.
  std::optional<glm::dvec3> groomed_m = {};
};

/// Rotates the end about the start until it is outside all spheres (two rounds, out of the deepest first),
/// then applies Coulomb friction.
glm::dvec3 pushed_out(const ReferenceSkin& skin, ReferenceSegment segment);

/// Rotates a segment about its start until its end lies on the sphere (center, radius): both equations of
/// Woodhouse figure 4.1 at once. Returns the nearest possible end if the two spheres do not intersect.
glm::dvec3 turned_onto_sphere(const ReferenceSegment& segment, const glm::dvec3& center, double radius);

/// Returns the velocity of wind and gusts at a point relative to the head joint, within the limits of
/// strand_layout.h.
glm::dvec3 air_velocity_mps(const StepInput& input, const glm::dvec3& point_m);

/// Returns the vector, shortened to `longest` if it is longer.
glm::dvec3 shortened(const glm::dvec3& value, double longest);

}  // namespace strandcast
