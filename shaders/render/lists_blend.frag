// Lists, second part: the k nearest nodes of each pixel are blended in order, k = 8; what lies behind them is mixed by
// opacity into one last layer, in integers, since a list has no order that could be relied on. Nodes of equal depth
// are ordered by their colour and opacity: those that are alike in all may change places. So the picture is the same
// whatever order the fragments came in.
// TressFX 4.1, which this follows, multiplies the colour by its opacity twice and gives the far ones no light; here
// both are as they should be.
#include "lib/opacity_sum.glsl"
#include "shared/bindings.h"

layout(std430, binding = kBindingListHead) restrict readonly buffer ListHead { uint node[]; } heads;
layout(std430, binding = kBindingListNode) restrict readonly buffer ListNode { uvec4 content[]; } nodes;
layout(std430, binding = kBindingListCount) restrict buffer ListCount {
  uint wanted;
  uint left_out;   // nodes at the end of lists that are too long
} count;

uniform int u_width;

layout(location = 0) out vec4 out_layer;

const int kKept = 8;
// Nodes of one pixel that are looked at, and those beyond that are still counted.
const uint kMostNodes = 4096u;
const uint kMostCounted = 60000u;
const uint kNoNode = 0xffffffffu;
// Colours of the far layer are summed in steps of 1 / kColorSteps, up to kMostColor each.
const float kColorSteps = 4096.0;
const float kMostColor = 64.0;

bool is_nearer(uvec3 a, uvec3 b) {
  return a.x != b.x ? a.x < b.x : (a.y != b.y ? a.y < b.y : a.z < b.z);
}

vec4 color_of(uvec3 node) { return vec4(unpackHalf2x16(node.y), unpackHalf2x16(node.z)); }

void main() {
  int pixel = int(gl_FragCoord.y) * u_width + int(gl_FragCoord.x);
  uint at = heads.node[pixel];
  uvec3 kept[kKept];   // depth, colour, colour with opacity; nearest first
  for (int k = 0; k < kKept; ++k) kept[k] = uvec3(kNoNode);
  uvec4 far = uvec4(0u);   // colour times opacity, and opacity
  uint far_log = 0u;
  for (uint i = 0u; at != 0u && i < kMostNodes; ++i) {
    uvec4 content = nodes.content[at - 1u];
    at = content.x;
    uvec3 node = content.yzw;
    for (int k = 0; k < kKept; ++k)
      if (is_nearer(node, kept[k])) {
        uvec3 farther = kept[k];
        kept[k] = node;
        node = farther;
      }
    if (node.x == kNoNode) continue;
    vec4 color = color_of(node);
    far += uvec4(vec4(clamp(color.rgb, 0.0, kMostColor) * color.a, color.a) * kColorSteps + 0.5);
    far_log += opacity_log(color.a);
  }
  uint beyond = 0u;
  while (at != 0u && beyond < kMostCounted) {
    at = nodes.content[at - 1u].x;
    ++beyond;
  }
  if (beyond > 0u) atomicAdd(count.left_out, beyond);

  vec3 sum = vec3(0.0);
  float passing = 1.0;
  for (int k = 0; k < kKept; ++k) {
    if (kept[k].x == kNoNode) break;
    vec4 color = color_of(kept[k]);
    sum += passing * color.a * color.rgb;
    passing *= 1.0 - color.a;
  }
  if (far.w > 0u) {
    float behind = transmitted(far_log);
    sum += passing * (1.0 - behind) * vec3(far.rgb) / float(far.w);
    passing *= behind;
  }
  out_layer = vec4(sum, 1.0 - passing);
}
