// The tractrix step in double precision, for the reference solvers, and the order in which vertices move.
// Written from the curve itself; shares no formula with shaders/sim/tractrix.glsl.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace strandcast {

/// Where the tail of a rigid segment goes that was at `tail` when its head was at `head_before`, once the
/// head has gone straight to `head`. Exact for any distance. A segment along the way, and one without a
/// direction, is carried along: also when the head moves towards the tail, where any other segment turns
/// around.
glm::dvec3 tractrix_followed(const glm::dvec3& head_before, const glm::dvec3& head, const glm::dvec3& tail,
                             double segment_m);

/// A permutation of 0 .. count-1 from integer hashes: the numbers below the next power of two go through
/// three rounds of odd multiplication, addition and shifted exclusive or, each of which is one to one, and
/// those that come out too large are left out. The same on every machine.
std::vector<uint32_t> shuffled_order(uint32_t count, uint32_t seed);

}  // namespace strandcast
