// GLSL's four-component vectors, matrices and unsigned vectors over lanes (common/simd/lanes.h), and uniform
// vectors, which have one value for all lanes. For kernels of the simulation.
#pragma once

#include "common/simd/lanes.h"

namespace strandcast::simd {
inline namespace STRANDCAST_LANE_NAMESPACE {

#include "common/simd/lane_matrices_private.h"

}  // namespace STRANDCAST_LANE_NAMESPACE
}  // namespace strandcast::simd
