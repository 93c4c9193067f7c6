// Three depths: a key per fragment that tells depth and opacity, and per pixel the three least keys of all.
#include "shared/bindings.h"

layout(std430, binding = kBindingDepthKeys) restrict buffer DepthKeys {
  uvec4 pixel[];   // three keys, nearest first; the opacities of all fragments (lib/opacity_sum.glsl)
} keys;

uniform int u_width;   // of the target

const uint kNoKey = 0xffffffffu;
const float kDepthSteps = 16777215.0;    // 24 bits: some micrometres at a metre
const float kOpacitySteps8 = 255.0;      // 8 bits

uint depth_key(float depth, float opacity) {
  return (uint(depth * kDepthSteps) << 8) | uint(opacity * kOpacitySteps8 + 0.5);
}
float key_opacity(uint key) { return float(key & 255u) / kOpacitySteps8; }
int pixel_index() { return int(gl_FragCoord.y) * u_width + int(gl_FragCoord.x); }
