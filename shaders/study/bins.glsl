// Bins in which a volume's nodes look for samples. BY_PLANES 0: cells of the grid, by counting sort (Woodhouse's [16]);
// 1: by the sides of random planes, locality-sensitive hashing (Woodhouse's [13]), bins of a fixed size.
#pragma variant BY_PLANES 0 1
#include "lib/hash.glsl"
#include "shared/limits.h"
#include "study/samples.glsl"

layout(local_size_x = kStrandLocalSize) in;
layout(std430, binding = kBindingStudyBins) restrict buffer CountBlock { uint count[]; } b_bins;

#if BY_PLANES
layout(std430, binding = kBindingStudyPlanes) readonly restrict buffer PlaneBlock { vec4 plane[]; } b_planes;
uniform uint u_plane_count;
uniform uint u_bin_count;  // a power of two
uniform uint u_bin_size;

uint bin_of(vec3 at) {
  uint signature = 0u;
  for (uint i = 0u; i < u_plane_count; ++i) {
    const vec4 plane = b_planes.plane[i];
    signature |= dot(plane.xyz, at) > plane.w ? 1u << i : 0u;
  }
  return mix_u32(signature) & (u_bin_count - 1u);
}
#else
uint bin_of(vec3 at) {
  const vec3 cell = floor(at);
  return uint((cell.z * u_node_count.y + cell.y) * u_node_count.x + cell.x);
}
#endif
