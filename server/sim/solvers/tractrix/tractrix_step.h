// The tractrix step in double precision, for the reference solvers, and the order in which vertices move.
// Written from the curve itself; shares no formula with shaders/sim/tractrix.glsl.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace strandcast {

/// Returns where the tail of a rigid segment is dragged to while its head moves straight from `head_before`
/// to `head`, at any distance. A segment of no length, or along the way, is shifted as a whole.
glm::dvec3 tractrix_followed(const glm::dvec3& head_before, const glm::dvec3& head, const glm::dvec3& tail,
                             double segment_m);

/// A permutation of 0 .. count-1 from integer hashes: the numbers below the next power of two go through
/// three rounds of odd multiplication, addition and shifted exclusive or, each of which is one to one, and
/// those that come out too large are left out. The same on every machine.
std::vector<uint32_t> shuffled_order(uint32_t count, uint32_t seed);

}  // namespace strandcast
