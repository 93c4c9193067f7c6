// The head under the hair.
#include "render/tile_frame.glsl"
layout(location = 0) in vec3 in_position_m;  // head space
layout(location = 1) in vec3 in_normal;
layout(location = 2) in float in_cover;      // 0 bare skin .. 1 under hair

out vec3 v_position_m;
out vec3 v_normal;
out float v_cover;

void main() {
  v_position_m = in_position_m;
  v_normal = in_normal;
  v_cover = in_cover;
  gl_Position = u_frame.clip_from_head * vec4(in_position_m, 1.0);
}
