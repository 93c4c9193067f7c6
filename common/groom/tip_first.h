// Finds strands whose points run from tip to root, by their neighbours and by which ends lie on a head. Any
// thread.
#pragma once

#include <string>

#include "common/groom/stated_groom.h"

namespace strandcast {

/// Turns strands round that leave a head at their last points, and those that run against the others beside
/// them. Pins stay at the first points. Returns what to say of it; empty where nothing was done.
std::string turn_tips_first(Groom& groom, StrandLabels& labels);

}  // namespace strandcast
