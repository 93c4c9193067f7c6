// A point of a drawn strand on the screen, lit and shaded (shaders/render/tile_shade.comp is the same for compute kernels).
#include "render/tile_frame.glsl"
#include "render/tile_light.glsl"
#include "lib/coverage.glsl"
#include "lib/hermite.glsl"

const float kSkinDepthM = 0.0005;   // strands this far behind the skin are still in front of it: roots stand in it

vec2 on_screen(vec3 point_m) {
  vec4 clip = u_frame.clip_from_head * vec4(point_m, 1.0);
  return 0.5 * u_frame.target.xy * (1.0 + clip.xy / max(clip.w, u_frame.eye.w));
}

struct Way {
  vec2 unit;      // none where it has no length
  float squared;  // px
};
Way way_between(vec2 from, vec2 to) {
  const float kNoWay = 1e-4;
  Way way;
  way.squared = dot(to - from, to - from);
  way.unit = way.squared > kNoWay ? (to - from) * inversesqrt(way.squared) : vec2(0.0);
  return way;
}

// On the screen from -1 to 1; to one corner of two across the strand, and to the other against it.
struct StrandPoint {
  vec2 middle;
  vec2 aside;
  float depth;
  LineFilter line;
  vec4 light;   // and opacity
};

ivec2 strand_place(uint strand) {
  const int kStrandsPerRow = 1024;
  return ivec2(int(strand) % kStrandsPerRow, int(strand) / kStrandsPerRow);
}

// Places in head space, m; beyond an end of a strand another one's. Of a strand: first point, points, number among all, lock.
StrandPoint strand_point(vec3 before_m, vec3 place_m, vec3 behind_m, uvec4 strand, uint number) {
  uint point = number - strand.x;
  uint last = strand.y - 1u;
  vec3 before = point == 0u ? place_m : before_m;
  vec3 behind = point >= last ? place_m : behind_m;
  HairLook look = frame_look();
  float along_step = 1.0 / float(max(last, 1u));
  float along = min(float(point) * along_step, 1.0);
  vec3 tangent = unit_or(behind - before, vec3(0.0, -1.0, 0.0));
  vec3 to_eye = unit_or(u_frame.eye.xyz - place_m, vec3(0.0, 0.0, 1.0));
  vec3 light = hair_radiance(look, hair_strand(strand.z, strand.w, look), frame_lights(), light_depth_at(place_m),
                             along, tangent, to_eye);
  vec4 clip = u_frame.clip_from_head * vec4(place_m, 1.0);
  float away = max(clip.w, u_frame.eye.w);
  float width = u_frame.strand.x * u_frame.target.z * (1.0 + (u_frame.strand.y - 1.0) * along * along) / away;
  float opacity = strand_cover(along, along_step, u_frame.strand.z);

  // Joints: cut across the mean of the directions before and behind; a strand that turns back across its longer side.
  vec2 here = on_screen(place_m);
  Way way_before = way_between(on_screen(before), here);
  Way way_behind = way_between(here, on_screen(behind));
  vec2 mitre = way_before.unit + way_behind.unit;
  vec2 longer = way_before.squared > way_behind.squared ? way_before.unit : way_behind.unit;
  if (dot(mitre, mitre) < 0.03) mitre = longer;
  vec2 direction = dot(mitre, mitre) > 0.0 ? normalize(mitre) : vec2(1.0, 0.0);
  const float kMostLean = 2.0;
  float lean = min(1.0 / max(dot(direction, longer), 1e-3), kMostLean);
  LineFilter line = line_filter(max(width, 1e-4), direction);
  vec2 aside = vec2(-direction.y, direction.x) * (line.reach * lean) * (2.0 / u_frame.target.xy);
  vec2 middle = 2.0 * here / u_frame.target.xy - 1.0;
  float near = u_frame.eye.w;
  float far = u_frame.target.w;
  float depth = (far + near - 2.0 * far * near / max(clip.w - kSkinDepthM, near)) / (far - near);
  return StrandPoint(middle, aside, depth, line, vec4(min(light, vec3(60000.0)), opacity));
}
