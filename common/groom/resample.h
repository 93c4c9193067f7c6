// Resampling: gives every strand the same number of vertices, evenly spaced along its arc. Any thread.
#pragma once

#include <cstdint>
#include <vector>

#include "common/groom/groom.h"

namespace strandcast {

/// Returns the groom with `vertex_count` (2..kMaxVertexCount) vertices per strand at equal arc lengths along
/// the old polyline. End points keep their bits; a strand of length zero keeps all vertices at its root.
/// Vertices pinned at the root and tip keep their number; pins in between are dropped.
Groom resample(const Groom& groom, uint32_t vertex_count);

/// Returns a value for each of those vertices, of `values` at the groom's own; none of none.
std::vector<float> resample(const Groom& groom, const std::vector<float>& values, uint32_t vertex_count);

}  // namespace strandcast
