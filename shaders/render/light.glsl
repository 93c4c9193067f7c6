// What reaches a point of the picture: the light volume holds, per cell, the part of the direct light and of the
// surrounding light that hair and skull let through.

uniform sampler3D u_light_volume;     // (direct, surrounding), each 0..1
uniform vec3 u_volume_origin_m;       // corner of cell (0, 0, 0), head space
uniform vec3 u_volume_from_m;         // 1 / (cells x cell size)
uniform vec3 u_to_light;              // unit, head space
uniform vec3 u_light_color;
uniform float u_ambient;
uniform vec3 u_up;                    // world's up, head space

// Who tells it: a row of common/scene/shadow_methods.h, by its number.
#pragma variant SHADOW 0 1 2 3 4 5 6
#if SHADOW == 0
vec2 light_at(vec3 point_m) { return texture(u_light_volume, (point_m - u_volume_origin_m) * u_volume_from_m).rg; }
#elif SHADOW == 1
vec2 light_at(vec3 point_m) { return vec2(1.0); }
#else
#include "render/shadow.glsl"
#endif
