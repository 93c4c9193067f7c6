// Resampling: gives every strand the same number of vertices, evenly spaced along its arc. Any thread.
#pragma once

#include <cstdint>

#include "common/groom/groom.h"

namespace strandcast {

/// The groom with `vertex_count` (2..kMaxVertexCount) vertices per strand at equal arc lengths of the old
/// polyline. Both ends stay bit for bit; a strand of length zero keeps all vertices on its root. As many
/// vertices as were pinned at the root and at the tip stay pinned there; pins in between are dropped.
Groom resample(const Groom& groom, uint32_t vertex_count);

}  // namespace strandcast
