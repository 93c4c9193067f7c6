// Progressive order of points: every prefix covers the set evenly. Any thread; deterministic.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace strandcast {

/// Returns the first `limit` indices of an order in which every prefix is spread evenly over the points. A
/// point is taken only if it is farther than a radius from all taken points; the radius shrinks until enough
/// are taken. Points are tried in a hashed order that depends on `seed`. Takes about n log n. Coincident
/// points come last.
std::vector<uint32_t> make_progressive_order(std::span<const glm::vec3> points, uint32_t limit,
                                             uint32_t seed);

}  // namespace strandcast
