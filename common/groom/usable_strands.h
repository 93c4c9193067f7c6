// Strands that can be used: those of a file that are broken or empty are left out and counted. Any thread.
#pragma once

#include <cstdint>
#include <span>

#include "common/base/result.h"
#include "common/groom/stated_groom.h"

namespace strandcast {

/// Leaves out strands with a point that is not finite or far from all other hair, and those that show
/// nothing: of fewer than two points or without length. Coordinates of roots that are not finite are bridged.
/// Notes count them. BadInput when nothing is left, or when more than a tenth is broken.
Result<StatedGroom> with_usable_strands(StatedGroom stated);

/// Removes the strands whose element is 0, with all that is said of them; takes no further memory.
void keep_strands(Groom& groom, StrandLabels& labels, std::span<const uint8_t> is_kept);

}  // namespace strandcast
