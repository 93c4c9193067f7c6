// HairStyle: direction of hair at rest at each point, and the regions that it keeps out of. Lengths are in
// skull radii about the skull's centre; +Y up, +Z out of the face. Hair is parted in the middle, combed to
// the sides and back, and then hangs. Values, any thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>

namespace strandcast {

/// Variation of one strand (or clump) against its neighbours.
struct StrandCharacter {
  glm::vec3 root{0.0f};     // in skull radii
  float side = 1.0f;        // -1 .. 1, never near 0: which side of the parting it is combed to
  float clearance = 0.05f;  // height above the skull at which it settles; upper hair lies over lower hair
  glm::vec3 sway{0.0f};     // added to the direction it is combed in
};

/// Returns a scalp point's signed distance from the parting along x, in skull radii; negative on the right
/// side (-X).
float beside_parting(const glm::vec3& root, uint32_t seed);

/// Maps a point of the scalp away from the parting. Roots spread evenly over the mapped points stand closer
/// together at the parting. Twice differentiable.
glm::vec3 moved_from_parting(const glm::vec3& root, uint32_t seed);
/// Largest factor by which the map makes roots closer along x.
inline constexpr float kPartingCloser = 10.0f;

/// Returns the character of a strand rooted at `root`; it varies slowly over the scalp, and a little with
/// `strand_hash`.
StrandCharacter make_character(const glm::vec3& root, uint32_t strand_hash, uint32_t seed);

/// Returns the unit direction that hair at `point` bends towards.
glm::vec3 combed_direction(const glm::vec3& point, const StrandCharacter& character);

/// Moves a point at arc length `arc` (skull radii) out of skull, face and neck.
glm::vec3 keep_outside(const glm::vec3& point, float arc, const StrandCharacter& character);

/// Moves a point out of the built-in head's neck and shoulders.
glm::vec3 keep_off_bust(const glm::vec3& point, const StrandCharacter& character);

}  // namespace strandcast
