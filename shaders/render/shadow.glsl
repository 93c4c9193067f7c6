// Optical depth of the hair between a point and the light, by the chosen method (common/scene/shadow_methods.h), and of
// the skull under it. Equations and traps: each method's file in common/render/shadow.

uniform mat4 u_map_from_head;      // texels of the light's map, and metres along the light
uniform vec3 u_skull_center_m;     // head space
uniform float u_skull_radius_m;    // 0: there is none

// Optical depth per metre inside the skull, as in the light volume.
const float kSkullPerM = 400.0;
// No map knows the other directions: light from around falls with a part of the depth towards the light, and never
// below a share of it.
const float kSurroundingShare = 0.2;
const float kLeastSurrounding = 0.35;

float skull_depth(vec3 point_m) {
  vec3 from_center = point_m - u_skull_center_m;
  float along = dot(from_center, u_to_light);
  float across2 = dot(from_center, from_center) - along * along;
  float chord2 = u_skull_radius_m * u_skull_radius_m - across2;
  if (chord2 <= 0.0) return 0.0;
  float half_chord = sqrt(chord2);
  return kSkullPerM * max(half_chord - max(along, -half_chord), 0.0);
}

// Texels are mixed after each has told its own depth: layers begin elsewhere in each (Yuksel and Keyser 2008, 3.2).
#define MIX_TEXELS(depth_in)                                                                  \
  vec3 at = (u_map_from_head * vec4(point_m, 1.0)).xyz;                                       \
  vec2 low = floor(at.xy - 0.5);                                                              \
  vec2 part = at.xy - 0.5 - low;                                                              \
  ivec2 first = ivec2(clamp(low, vec2(-1.0), vec2(u_map_texels)));                            \
  float below = mix(depth_in(first, at.z), depth_in(first + ivec2(1, 0), at.z), part.x);      \
  float above = mix(depth_in(first + ivec2(0, 1), at.z), depth_in(first + ivec2(1), at.z), part.x); \
  return mix(below, above, part.y);

uniform int u_map_texels;          // along each side

ivec2 inside_map(ivec2 texel) { return clamp(texel, ivec2(0), ivec2(u_map_texels - 1)); }

#if SHADOW == 2
// Deep opacity map: depth in front of the ends of three layers, and where the first begins.
uniform sampler2D u_opacity_layers;
uniform vec3 u_layer_ends_m;       // of the first two behind the first strand of each texel, of the third behind all hair

float layered_depth(ivec2 texel, float depth_m) {
  vec4 layers = texelFetch(u_opacity_layers, inside_map(texel), 0);
  float behind = depth_m - layers.a;
  // The last layer catches all that is left, so it ends where hair does.
  vec3 ends = vec3(u_layer_ends_m.xy, max(u_layer_ends_m.z - layers.a, 1.001 * u_layer_ends_m.y));
  if (behind <= 0.0) return 0.0;
  if (behind < ends.x) return layers.r * behind / ends.x;
  if (behind < ends.y) return mix(layers.r, layers.g, (behind - ends.x) / (ends.y - ends.x));
  return mix(layers.g, layers.b, min((behind - ends.y) / (ends.z - ends.y), 1.0));
}

float hair_depth(vec3 point_m) { MIX_TEXELS(layered_depth) }

#elif SHADOW == 3 || SHADOW == 6
uniform sampler2D u_slices_0;
uniform sampler2D u_slices_1;
uniform sampler2D u_slices_2;
uniform sampler2D u_slices_3;
uniform float u_slice_m;           // thickness

vec4 slices_at(int group, ivec2 texel) {
  if (group == 0) return texelFetch(u_slices_0, texel, 0);
  if (group == 1) return texelFetch(u_slices_1, texel, 0);
  if (group == 2) return texelFetch(u_slices_2, texel, 0);
  return texelFetch(u_slices_3, texel, 0);
}

#if SHADOW == 3
// Opacity shadow maps: depth in front of the end of each of 16 slices.
float sliced_depth(ivec2 texel, float depth_m) {
  texel = inside_map(texel);
  float slices = clamp(depth_m / u_slice_m, 0.0, 16.0);
  int slice = min(int(slices), 15);
  float end = slices_at(slice >> 2, texel)[slice & 3];
  float begin = slice > 0 ? slices_at((slice - 1) >> 2, texel)[(slice - 1) & 3] : 0.0;
  return mix(begin, end, slices - float(slice));
}
#else
// Hybrid: depth within each of 16 slices, of which the one that holds the first strand begins there.
uniform sampler2D u_first_depth;

float sliced_depth(ivec2 texel, float depth_m) {
  texel = inside_map(texel);
  float first_m = texelFetch(u_first_depth, texel, 0).r;
  float sum = 0.0;
  for (int group = 0; group < 4; ++group) {
    vec4 begin = (float(4 * group) + vec4(0.0, 1.0, 2.0, 3.0)) * u_slice_m;
    vec4 end = begin + u_slice_m;
    begin = clamp(vec4(first_m), begin, end - 1e-3 * u_slice_m);
    sum += dot(slices_at(group, texel), clamp((depth_m - begin) / (end - begin), 0.0, 1.0));
  }
  return sum;
}
#endif

float hair_depth(vec3 point_m) { MIX_TEXELS(sliced_depth) }

#elif SHADOW == 4
// Rays: density of crossings summed from the point to where the ray leaves the cube.
uniform sampler3D u_density;
uniform vec3 u_cube_origin_m;
uniform float u_cube_from_m;       // 1 / its side
uniform float u_density_per_m;     // of a texel's value

const int kRaySteps = 32;

float hair_depth(vec3 point_m) {
  vec3 from = (point_m - u_cube_origin_m) * u_cube_from_m;
  vec3 way = u_to_light * u_cube_from_m;
  vec3 steep = mix(vec3(1e-6), abs(way), greaterThan(abs(way), vec3(1e-6)));
  vec3 room = mix(from, 1.0 - from, greaterThan(way, vec3(0.0))) / steep;
  float length_m = max(min(min(room.x, room.y), room.z), 0.0);
  vec3 one = way * (length_m / float(kRaySteps));
  float sum = 0.0;
  for (int i = 0; i < kRaySteps; ++i) sum += texture(u_density, from + (float(i) + 0.5) * one).r;
  return sum * u_density_per_m * length_m / float(kRaySteps);
}

#elif SHADOW == 5
// Deep shadow map: of each texel, how depth grows step by step.
uniform samplerBuffer u_deep_texels;   // (texels) first step, count of steps
uniform samplerBuffer u_deep_steps;    // where it grows, and to how much

float stepped_depth(ivec2 texel, float depth_m) {
  texel = inside_map(texel);
  vec2 range = texelFetch(u_deep_texels, texel.y * u_map_texels + texel.x).rg;
  int low = int(range.x);
  int high = low + int(range.y);
  int begin = low;
  while (low < high) {
    int middle = (low + high) / 2;
    if (texelFetch(u_deep_steps, middle).r < depth_m) low = middle + 1;
    else high = middle;
  }
  return low > begin ? texelFetch(u_deep_steps, low - 1).g : 0.0;
}

float hair_depth(vec3 point_m) { MIX_TEXELS(stepped_depth) }
#endif

vec2 light_at(vec3 point_m) {
  float depth = hair_depth(point_m) + skull_depth(point_m);
  return vec2(exp(-depth), mix(kLeastSurrounding, 1.0, exp(-kSurroundingShare * depth)));
}
