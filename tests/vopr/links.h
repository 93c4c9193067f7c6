// Links: what a viewer gets over links of every rate, delay and share of stalls, on simulated time. Decoding
// and drawing take none of it.
#pragma once

#include <cstdint>

namespace strandcast::vopr {

enum class LinkGrid { Corners, Whole };

/// Each link in a process of its own, with a server of the built-in scene whose head turns. Prints a line a
/// link; returns how many break a rule.
int walk_links(LinkGrid grid);

}  // namespace strandcast::vopr
