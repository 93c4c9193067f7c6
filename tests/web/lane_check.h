// What lanes make of numbers at the edges: signed zeros, numbers too small for full precision, the least and
// the greatest, infinities, NaN, ends of the integers.
#pragma once

#include <string>

namespace strandcast {

/// A line for every function of kernels' lanes: its name and a hash of its results.
std::string lane_results();

}  // namespace strandcast
