// The head under the hair for tiles, to be lit once per pixel.
#include "lib/hermite.glsl"
#include "render/tile_head.glsl"

in vec3 v_position_m;
in vec3 v_normal;
in float v_cover;

layout(location = 0) out vec4 out_skin;

void main() { out_skin = packed_skin(unit_or(v_normal, vec3(0.0, 0.0, 1.0)), v_cover); }
