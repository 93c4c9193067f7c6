// A prefix of strands. At load, strands are ordered so that the first n cover the head evenly and can stand
// for all. A stream for a slow link codes only those. Pure functions, any thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "common/strands/snapshot.h"

namespace strandcast {

/// Returns how many of `strand_count` strands a share in (0, 1] means: at least 1.
uint32_t prefix_count(uint32_t strand_count, float share);

/// Returns a snapshot with the first `count` strands, or all if it has fewer.
Snapshot prefix_of(const Snapshot& snapshot, uint32_t count);

/// Returns the first `count` strands of a shape of (vertex_count x strand_count) points, strand fastest.
/// Empty if it has fewer strands or another size.
std::vector<glm::vec3> prefix_of_shape(std::span<const glm::vec3> shape, uint32_t vertex_count,
                                       uint32_t count);

}  // namespace strandcast
