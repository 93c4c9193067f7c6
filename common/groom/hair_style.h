// HairStyle: the direction in which hair at rest runs, point by point, and where it must not be. Lengths are
// in skull radii about the skull's centre; +Y up, +Z out of the face. Hair is parted in the middle, combed to
// the sides and back and then hangs. Values, any thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>

namespace strandcast {

/// What one strand (or one clump) does differently from its neighbours.
struct StrandCharacter {
  glm::vec3 root{0.0f};     // in skull radii
  float side = 1.0f;        // -1 .. 1, never near 0: which side of the parting it is combed to
  float clearance = 0.05f;  // height above the skull at which it settles; upper hair lies over lower hair
  glm::vec3 sway{0.0f};     // added to the direction it is combed in
};

/// How far a point of the scalp is beside the parting, in skull radii along x; negative to its right (-X).
float beside_parting(const glm::vec3& root, uint32_t seed);

/// Where to spread roots evenly so that on the scalp they stand closer across the parting than elsewhere: a
/// point of the scalp, moved away from the parting. Twice differentiable.
glm::vec3 moved_from_parting(const glm::vec3& root, uint32_t seed);
/// Roots stand at most so many times closer for it, along x.
inline constexpr float kPartingCloser = 10.0f;

/// The character of a strand rooted at `root`; varies slowly over the scalp, and a little with `strand_hash`.
StrandCharacter make_character(const glm::vec3& root, uint32_t strand_hash, uint32_t seed);

/// Unit direction that hair at `point` turns towards.
glm::vec3 combed_direction(const glm::vec3& point, const StrandCharacter& character);

/// Moves a point at arc length `arc` (in skull radii) out of the skull, the face and the neck.
glm::vec3 keep_outside(const glm::vec3& point, float arc, const StrandCharacter& character);

/// Moves a point out of the built-in head's neck and shoulders.
glm::vec3 keep_off_bust(const glm::vec3& point, const StrandCharacter& character);

}  // namespace strandcast
