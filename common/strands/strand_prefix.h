// A prefix of strands: a scene's strands are ordered at load such that the first n cover the head evenly, so
// the first n alone are a picture of all. A stream for a slow link codes only those. Pure functions, any
// thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "common/strands/snapshot.h"

namespace strandcast {

/// How many of `strand_count` strands a share in (0, 1] stands for: at least 1.
uint32_t prefix_count(uint32_t strand_count, float share);

/// The first `count` strands of a snapshot (at most all).
Snapshot prefix_of(const Snapshot& snapshot, uint32_t count);

/// The first `count` strands of a shape of (vertex_count x strand_count), strand fastest; nothing when it has
/// fewer or is no such shape.
std::vector<glm::vec3> prefix_of_shape(std::span<const glm::vec3> shape, uint32_t vertex_count,
                                       uint32_t count);

}  // namespace strandcast
