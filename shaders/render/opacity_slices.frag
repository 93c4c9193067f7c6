// Slices at fixed depths, 16 in four targets of one draw (Nalu, GPU Gems 2, chapter 23). Opacity shadow maps (0): a
// strand adds itself to its slice and to all behind it. Hybrid (1): to its slice alone, and its depth to the least.
#pragma variant IS_HYBRID 0 1
#include "render/shadow_map.glsl"

uniform float u_slice_m;   // thickness

layout(location = 0) out vec4 out_slices_0;
layout(location = 1) out vec4 out_slices_1;
layout(location = 2) out vec4 out_slices_2;
layout(location = 3) out vec4 out_slices_3;
#if IS_HYBRID == 1
layout(location = 4) out float out_first_m;
#endif

const int kLastSlice = 15;

vec4 share_of(int first, int slice) {
  ivec4 slices = first + ivec4(0, 1, 2, 3);
#if IS_HYBRID == 1
  return vec4(equal(slices, ivec4(slice)));
#else
  return vec4(greaterThanEqual(slices, ivec4(slice)));
#endif
}

void main() {
  float depth = added_depth();
  if (depth <= 0.0) discard;
  int slice = clamp(int(floor(v_depth_m / u_slice_m)), 0, kLastSlice);
  out_slices_0 = depth * share_of(0, slice);
  out_slices_1 = depth * share_of(4, slice);
  out_slices_2 = depth * share_of(8, slice);
  out_slices_3 = depth * share_of(12, slice);
#if IS_HYBRID == 1
  out_first_m = v_depth_m;
#endif
}
