// The segments of eight nodes that hair comes to, of which all passes over nodes are. An invocation per row of
// nodes.
#include "volume/facts.glsl"

layout(local_size_x = kVolumeLocalSize) in;
layout(std430, binding = kBindingVolumeFacts) restrict buffer FactBlock { uint fact[]; } b_facts;
// First node, and where it lies.
layout(std430, binding = kBindingVolumeLists) writeonly restrict buffer ListBlock { uvec4 segment[]; } b_lists;
layout(binding = kUnitVolumeMask) uniform usamplerBuffer u_mask;

uniform uint u_reach;  // nodes that smoothing goes

void main() {
  const uvec3 nodes = volume_nodes();
  const uint row = volume_invocation();
  if (row >= nodes.y * nodes.z) return;
  const uint y = row % nodes.y;
  const uint z = row / nodes.y;
  uvec2 mask = uvec2(0u);
  const uint reach = u_reach + 1u;
  for (uint other_z = max(z, reach) - reach; other_z <= min(z + u_reach, nodes.z - 1u); ++other_z)
    for (uint other_y = max(y, reach) - reach; other_y <= min(y + u_reach, nodes.y - 1u); ++other_y)
      mask |= texelFetch(u_mask, int(other_z * nodes.y + other_y)).xy;
  const uint count = uint(bitCount(mask.x) + bitCount(mask.y));
  if (count == 0u) return;
  uint at = atomicAdd(b_facts.fact[kFactSegments], count);
  while ((mask.x | mask.y) != 0u) {
    const bool is_low = mask.x != 0u;
    const uint bit = uint(findLSB(is_low ? mask.x : mask.y));
    if (is_low)
      mask.x &= mask.x - 1u;
    else
      mask.y &= mask.y - 1u;
    const uint x = (is_low ? bit : bit + 32u) * kVolumeSegment;
    b_lists.segment[at] = uvec4(row * nodes.x + x, x, y, z);
    ++at;
  }
}
