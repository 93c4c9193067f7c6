// Limits that C++ and GLSL must agree on. Included by both: only "const uint" and "const int" lines here,
// with names that no other header uses.
#ifndef STRANDCAST_SHADERS_SHARED_LIMITS_H
#define STRANDCAST_SHADERS_SHARED_LIMITS_H

#ifdef __cplusplus
#include <cstdint>
namespace strandcast::shader {
using uint = uint32_t;
#endif

// Invocations per group of one-dimensional kernels with one strand per invocation: several times the 8 lanes
// of llvmpipe and one or two warps elsewhere.
const uint kStrandLocalSize = 64u;

// Invocations per group of kernels with one vertex per invocation: as many whole strands as fit.
const uint kVertexLocalSize = 128u;

// Invocations that make running sums, alone; samples along the side of a block whose depth is known to
// culling.
const uint kRunningSumLocalSize = 128u;
const uint kCullBlock = 16u;

// llvmpipe indexes tessellated vertices of one draw with 16 bits and draws wrongly past that, without an
// error: patches x lines x (segments + 1) of a draw stays at or below this.
const uint kMaxTessellatedVerticesPerDraw = 65535u;

// Largest tessellation level that every GL 4.5 device offers.
const uint kMaxTessellationLevel = 64u;

// The same limits as in common/ and server/sim under the same names; a test compares them.
const uint kMaxVertexCount = 64u;  // per strand
const uint kMaxSphereColliders = 16u;
const uint kMaxGustWaves = 8u;
const uint kMaxBodyCapsules = 16u;
const uint kMaxBodyPlanes = 4u;

#ifdef __cplusplus
}  // namespace strandcast::shader
#endif

#endif
