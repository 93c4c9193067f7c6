// What every kernel over lanes includes, precompiled once for each instruction set (strandcast_lane_objects).
// Nothing here may come from the standard library's inline functions (lane_kernel.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <new>
#if defined(__SSE2__)
#include <immintrin.h>
#elif !defined(__aarch64__)
#define STRANDCAST_LANES_FLUSH 1  // no mode of the processor does it
#endif

#include "common/kernels/lane_kernel.h"
#include "common/kernels/plane_role.h"
#include "common/simd/lane_matrices.h"
#include "common/simd/lane_pairs.h"
#include "shaders/shared/bindings.h"
#include "shaders/shared/limits.h"
