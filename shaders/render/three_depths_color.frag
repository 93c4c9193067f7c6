// Three depths, second part: each of the three nearest fragments adds its colour with the weight that it has behind
// the ones in front of it; the others add theirs, by opacity, to the mean colour of all that is farther. TressFX adds
// colours times opacity of the three without regard to their order, times their opacity once more, and takes the mean.
#include "render/blended.glsl"
#include "render/three_depths.glsl"

layout(location = 0) out vec4 out_near;   // weighted colour, weight
layout(location = 1) out vec4 out_far;    // colour times opacity, opacity

void main() {
  float opacity = strand_opacity();
  if (opacity < kLeastOpacity) discard;
  uint key = depth_key(gl_FragCoord.z, opacity);
  uvec3 nearest = keys.pixel[pixel_index()].xyz;
  float passing = 1.0;
  bool is_near = true;
  if (key > nearest.x) {
    passing = 1.0 - key_opacity(nearest.x);
    if (key > nearest.y) {
      passing *= 1.0 - key_opacity(nearest.y);
      is_near = key == nearest.z;
    }
  }
  float weight = passing * opacity;
  out_near = is_near ? vec4(weight * v_color, weight) : vec4(0.0);
  out_far = is_near ? vec4(0.0) : vec4(opacity * v_color, opacity);
}
