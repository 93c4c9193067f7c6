// Occlusion culling: the farthest depth of what is opaque in each block of samples, one invocation per block.
#include "shared/bindings.h"
#include "shared/limits.h"

layout(local_size_x = kStrandLocalSize) in;

layout(std430, binding = kBindingCullDepth) restrict writeonly buffer CullDepth {
  float block[];  // (u_blocks_across * u_blocks_down)
} farthest;

uniform sampler2D u_scene_depth;
uniform int u_blocks_across;
uniform int u_blocks_down;

void main() {
  int index = int(gl_GlobalInvocationID.x);
  if (index >= u_blocks_across * u_blocks_down) return;
  ivec2 first = ivec2(index % u_blocks_across, index / u_blocks_across) * int(kCullBlock);
  ivec2 last = min(first + int(kCullBlock), textureSize(u_scene_depth, 0));
  float depth = 0.0;
  for (int y = first.y; y < last.y; ++y)
    for (int x = first.x; x < last.x; ++x) depth = max(depth, texelFetch(u_scene_depth, ivec2(x, y), 0).r);
  farthest.block[index] = depth;
}
