// Vectors of four, matrices and unsigned vectors of GLSL over lanes (common/simd/lanes.h), and vectors that
// are the same in all lanes. For kernels of the simulation.
#pragma once

#include "common/simd/lanes.h"

namespace strandcast::simd {
inline namespace STRANDCAST_LANE_NAMESPACE {

#include "common/simd/lane_matrices_private.h"

}  // namespace STRANDCAST_LANE_NAMESPACE
}  // namespace strandcast::simd
