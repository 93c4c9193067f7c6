// Lists: every fragment of a strand becomes a node of its pixel's list (Yang et al. 2010). What finds no room is
// counted and left out. A node is 16 bytes: the next one, depth, and colour with opacity in half floats.
#include "render/blended.glsl"
#include "shared/bindings.h"

layout(std430, binding = kBindingListHead) restrict buffer ListHead {
  uint node[];   // (pixels) 1 + the last node of the pixel; 0 = none
} heads;
layout(std430, binding = kBindingListNode) restrict writeonly buffer ListNode { uvec4 content[]; } nodes;
layout(std430, binding = kBindingListCount) restrict buffer ListCount {
  uint wanted;     // nodes, also those for which there is no room
  uint left_out;   // see lists_blend.frag
} count;

uniform uint u_room;    // nodes
uniform int u_width;    // of the target

void main() {
  float opacity = strand_opacity();
  if (opacity < kLeastOpacity) discard;
  uint node = atomicAdd(count.wanted, 1u);
  if (node >= u_room) return;
  int pixel = int(gl_FragCoord.y) * u_width + int(gl_FragCoord.x);
  uint next = atomicExchange(heads.node[pixel], node + 1u);
  nodes.content[node] = uvec4(next, floatBitsToUint(gl_FragCoord.z), packHalf2x16(v_color.rg),
                              packHalf2x16(vec2(v_color.b, opacity)));
}
