// Deep opacity map, first draw: where hair begins in each texel, as depth.
#include "render/shadow_map.glsl"

void main() {
  if (added_depth() <= 0.0) discard;
}
