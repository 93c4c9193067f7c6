// Skin in the hair's shadow.
#include "render/tile_frame.glsl"
#include "render/tile_light.glsl"
#include "lib/hermite.glsl"
#include "lib/skin.glsl"

in vec3 v_position_m;
in vec3 v_normal;
in float v_cover;

layout(location = 0) out vec4 out_color;

void main() {
  vec3 normal = unit_or(v_normal, vec3(0.0, 0.0, 1.0));
  vec3 to_eye = unit_or(u_frame.eye.xyz - v_position_m, vec3(0.0, 0.0, 1.0));
  LightDepth depth = light_depth_at(v_position_m + u_frame.up.w * normal);
  out_color = vec4(skin_radiance(u_frame.skin_color.rgb, u_frame.root_color.rgb, frame_lights(), depth, normal, to_eye,
                                 v_cover), 1.0);
}
