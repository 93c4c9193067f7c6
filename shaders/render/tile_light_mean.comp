// Depth of a light that comes along several ways: of what they let through together. One invocation per halved cell.
#include "render/tile_frame.glsl"

layout(local_size_x = 32, local_size_y = 2) in;

layout(std430, binding = kBindingTileSwept) restrict readonly buffer Swept {
  float depth[];   // (ways x half_size) from the light
} b_swept;
layout(r32f, binding = kImageTileDepth) restrict writeonly uniform image3D u_depth;

uniform int u_way_count;
uniform float u_reach;   // each way loses exp(-this * depth) of its light

void main() {
  ivec3 at = ivec3(gl_GlobalInvocationID);
  ivec3 size = u_frame.half_size.xyz;
  if (any(greaterThanEqual(at, size))) return;
  int cell = (at.z * size.y + at.y) * size.x + at.x;
  float open = 0.0;
  for (int way = 0; way < u_way_count; ++way) open += exp(-u_reach * b_swept.depth[way * size.x * size.y * size.z + cell]);
  const float kLeast = 1e-6;
  float depth = -log(max(open / float(u_way_count), kLeast)) / u_reach;
  imageStore(u_depth, at, vec4(depth));
}
