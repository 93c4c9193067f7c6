// Three depths, first part: the three nearest fragments of each pixel by nested atomic minima, and the opacity of all.
#include "lib/opacity_sum.glsl"
#include "render/blended.glsl"
#include "render/three_depths.glsl"

void main() {
  float opacity = strand_opacity();
  if (opacity < kLeastOpacity) discard;
  uint key = depth_key(gl_FragCoord.z, opacity);
  int at = pixel_index();
  atomicAdd(keys.pixel[at].w, opacity_log(opacity));
  uint nearer = atomicMin(keys.pixel[at].x, key);
  key = max(nearer, key);
  nearer = atomicMin(keys.pixel[at].y, key);
  key = max(nearer, key);
  atomicMin(keys.pixel[at].z, key);
}
