// From points in head space to what is drawn: pixels, depth, width, joints and light, once per point, in place; one
// invocation per strand.
#include "render/tile_frame.glsl"
#include "render/tile_light.glsl"
#include "render/tile_points.glsl"
#include "lib/hermite.glsl"

layout(local_size_x = kStrandLocalSize) in;

layout(std430, binding = kBindingTilePoints) restrict writeonly buffer TilePoints {
  uvec4 texel[];   // (points x 2)
} b_points;

struct ScreenPoint {
  vec2 at;      // px
  float away;   // m along the view
  float per_away;
};

ScreenPoint on_screen(vec3 point_m) {
  vec4 clip = u_frame.clip_from_head * vec4(point_m, 1.0);
  ScreenPoint s;
  s.away = clip.w;
  s.per_away = 1.0 / max(clip.w, u_frame.eye.w);
  s.at = 0.5 * u_frame.target.xy + vec2(0.5, -0.5) * u_frame.target.xy * clip.xy * s.per_away;
  return s;
}

// Between two points on the screen.
struct Way {
  vec2 unit;      // none where it has no length
  float squared;  // px
};

Way way_between(vec2 from, vec2 to) {
  const float kNoWay = 1e-4;  // squared pixels; what is shorter points anywhere
  Way way;
  way.squared = dot(to - from, to - from);
  way.unit = way.squared > kNoWay ? (to - from) * inversesqrt(way.squared) : vec2(0.0);
  return way;
}

void main() {
  uint strand = gl_GlobalInvocationID.x;
  if (strand >= u_frame.strands.x) return;
  StrandNumbers numbers = strand_numbers(strand);
  HairLook look = frame_look();
  HairLights lights = frame_lights();
  HairStrand hair = hair_strand(numbers.index, numbers.lock, look);
  uint first = first_point(strand);
  uint last = numbers.point_count - 1u;
  float along_step = 1.0 / float(max(last, 1u));
  vec3 place = point_place(first);
  vec3 before = place;
  ScreenPoint here = on_screen(place);
  Way way_before = Way(vec2(0.0), 0.0);
  for (uint k = 0u; k <= last; ++k) {
    // Read before anything is written over it.
    vec3 behind = point_place(first + min(k + 1u, last));
    ScreenPoint next = on_screen(behind);
    vec3 tangent = unit_or(behind - before, vec3(0.0, -1.0, 0.0));
    vec3 to_eye = unit_or(u_frame.eye.xyz - place, vec3(0.0, 0.0, 1.0));
    float along = min(float(k) * along_step, 1.0);
    vec3 light = hair_radiance(look, hair, lights, light_depth_at(place), along, tangent, to_eye);
    float width = u_frame.strand.x * u_frame.target.z * (1.0 + (u_frame.strand.y - 1.0) * along * along) * here.per_away;
    float opacity = strand_cover(along, along_step, u_frame.strand.z);
    // Joints: across the mean of the directions before and behind. A strand that turns back is cut across its longer side,
    // which hides the other one.
    Way way_behind = way_between(here.at, next.at);
    vec2 mitre = way_before.unit + way_behind.unit;
    if (dot(mitre, mitre) < 0.03) mitre = way_before.squared > way_behind.squared ? way_before.unit : way_behind.unit;
    const float kMostHalf = 65504.0;
    light = min(light, vec3(kMostHalf));
    uint texel = 2u * (first + k);
    b_points.texel[texel] = uvec4(floatBitsToUint(vec3(here.at, here.away)), 0u);
    b_points.texel[texel + 1u] = uvec4(packHalf2x16(mitre), packHalf2x16(vec2(min(width, kMostHalf), opacity)),
                                       packHalf2x16(light.rg), packHalf2x16(vec2(light.b, 0.0)));
    way_before = way_behind;
    before = place;
    place = behind;
    here = next;
  }
}
