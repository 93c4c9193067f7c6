// Strands over head and background, from front to back with exact coverage; one invocation per column of a tile, which
// keeps its pixels in vectors of four. Row 0 of the picture is its top, of the head's target its bottom.
#pragma variant HAS_BACKDROP 0 1
#include "render/tile_frame.glsl"
#include "render/tile_head.glsl"
#include "shared/backdrop.h"
#include "render/tile_light.glsl"
#include "lib/coverage.glsl"
#include "lib/hermite.glsl"
#include "lib/skin.glsl"
#include "lib/tone.glsl"

layout(local_size_x = kTileColumns, local_size_y = kTilesPerGroup) in;

layout(binding = kUnitTilePoints) uniform usamplerBuffer u_points;
layout(binding = kUnitTileOrder) uniform usamplerBuffer u_order;   // depth, first point
layout(binding = kUnitTileFirst) uniform usamplerBuffer u_first;   // (tiles + 1)
layout(binding = kUnitTileHeadSkin) uniform sampler2D u_head_skin;    // kHeadSide x kHeadSide samples per pixel (tile_head.glsl)
layout(binding = kUnitTileHeadDepth) uniform sampler2D u_head_depth;   // 1: nothing
#if HAS_BACKDROP == 1
layout(binding = kUnitBackdrop) uniform sampler2D u_backdrop;   // sRGB, of the picture's size, its top first
#endif
uniform float u_head_share;       // of a pixel that one sample is; 0: there is no head
layout(rgba8, binding = kImageTilePicture) restrict writeonly uniform image2D u_picture;

// Light that still passes when a pixel counts as opaque.
const float kOpaque = 1.0 / 300.0;
// Strands this far behind the skin are still in front of it: roots stand in it.
const float kSkinDepthM = 0.0005;
const float kFar = 1e30;
const int kHeadSide = 2;   // samples

// Four pixels one below the other.
struct Pixels {
  vec4 red;
  vec4 green;
  vec4 blue;
  vec4 passed;     // share of what lies behind that is still seen
  vec4 depth;      // of the head, m
  vec4 seen;       // share of the pixel that is head and has no strand in front of it yet
  vec4 y;          // middles
};

float metres_away(float depth) {
  float near = u_frame.eye.w;
  float far = u_frame.target.w;
  return near * far / (far - depth * (far - near));
}

// The head in one pixel.
struct HeadPixel {
  float depth;    // of the nearest sample, m
  float share;    // of the pixel
  ivec2 sample_at;  // one that is head
};

HeadPixel head_pixel(ivec2 pixel) {
  // Upper samples first.
  ivec2 from_bottom = ivec2(pixel.x, int(u_frame.target.y) - 1 - pixel.y) * kHeadSide + ivec2(0, kHeadSide - 1);
  HeadPixel head = HeadPixel(kFar, 0.0, ivec2(0));
  for (int i = kHeadSide * kHeadSide - 1; i >= 0; --i) {
    ivec2 at = from_bottom + ivec2(i % kHeadSide, -(i / kHeadSide));
    float depth = texelFetch(u_head_depth, at, 0).r;
    bool is_head = depth < 1.0;
    head.depth = is_head ? min(head.depth, metres_away(depth)) : head.depth;
    head.share += is_head ? u_head_share : 0.0;
    head.sample_at = is_head ? at : head.sample_at;
  }
  return head;
}

vec3 head_light(HeadPixel head) {
  vec4 skin = texelFetch(u_head_skin, head.sample_at, 0);
  vec3 normal = skin_normal(skin);
  vec2 ndc = (vec2(head.sample_at) + 0.5) / (u_frame.target.xy * float(kHeadSide)) * 2.0 - 1.0;
  vec4 place = u_frame.head_from_clip * vec4(ndc, 2.0 * texelFetch(u_head_depth, head.sample_at, 0).r - 1.0, 1.0);
  vec3 position_m = place.xyz / place.w;
  vec3 to_eye = unit_or(u_frame.eye.xyz - position_m, vec3(0.0, 0.0, 1.0));
  LightDepth depth = light_depth_at(position_m + u_frame.up.w * normal);
  return skin_radiance(u_frame.skin_color.rgb, u_frame.root_color.rgb, frame_lights(), depth, normal, to_eye, skin.a);
}

Pixels begin_pixels(ivec2 top) {
  Pixels p;
  p.red = p.green = p.blue = vec4(0.0);
  p.passed = vec4(1.0);
  for (int i = 0; i < 4; ++i) {
    HeadPixel head = head_pixel(top + ivec2(0, i));
    p.depth[i] = head.depth;
    p.seen[i] = head.share;
  }
  p.y = float(top.y) + vec4(0.5, 1.5, 2.5, 3.5);
  return p;
}

// One end of a segment.
struct End {
  vec3 place;    // px, px, m
  vec2 mitre;
  float width;   // px
  float opacity;
  vec3 light;
};

End end_at(int texel) {
  uvec4 place = texelFetch(u_points, texel);
  uvec4 half_values = texelFetch(u_points, texel + 1);
  vec2 width_opacity = unpackHalf2x16(half_values.y);
  return End(uintBitsToFloat(place.xyz), unpackHalf2x16(half_values.x), width_opacity.x, width_opacity.y,
             vec3(unpackHalf2x16(half_values.z), unpackHalf2x16(half_values.w).x));
}

// What all pixels of a column need of a segment.
struct Segment {
  End a;
  End b;
  vec2 unit;
  vec2 along;
  float beyond;   // an end nothing is covered further than this, of the length: sharp bends have long mitres
  float base;
  float slope;
  float peak;
};

Segment segment_at(int point) {
  Segment s;
  s.a = end_at(2 * point);
  s.b = end_at(2 * point + 2);
  vec2 way = s.b.place.xy - s.a.place.xy;
  float per_length2 = 1.0 / dot(way, way);
  s.unit = way * sqrt(per_length2);
  s.along = way * per_length2;
  // The filter of the middle, times the width where it is: coverage adds up to the width all along.
  float mean_width = max(0.5 * (s.a.width + s.b.width), 1e-4);
  LineFilter filter_of_middle = line_filter(mean_width, s.unit);
  s.beyond = filter_of_middle.reach * sqrt(per_length2);
  s.base = filter_of_middle.base / mean_width;
  s.slope = filter_of_middle.slope / mean_width;
  s.peak = filter_of_middle.peak / mean_width;
  return s;
}

// Blends a segment under what lies in front of it.
void blend(Segment s, float x, inout Pixels p) {
  float ax = x - s.a.place.x;
  vec4 ay = p.y - s.a.place.y;
  vec4 across = ax * s.unit.y - ay * s.unit.x;
  vec4 along = ax * s.along.x + ay * s.along.y;
  vec4 part = clamp(along, 0.0, 1.0);
  vec4 cover = min(min(s.base - s.slope * abs(across), s.peak) * (s.a.width + part * (s.b.width - s.a.width)), 1.0);
  // A pixel belongs to the segment between the mitres of its ends, computed alike on both sides of one.
  vec4 behind_a = ax * s.a.mitre.x + ay * s.a.mitre.y;
  vec4 behind_b = (x - s.b.place.x) * s.b.mitre.x + (p.y - s.b.place.y) * s.b.mitre.y;
  vec4 opacity = max(cover, 0.0) * (s.a.opacity + part * (s.b.opacity - s.a.opacity));
  vec4 z = s.a.place.z + part * (s.b.place.z - s.a.place.z);
  vec4 is_mine = vec4(greaterThanEqual(behind_a, vec4(0.0))) * vec4(lessThan(behind_b, vec4(0.0))) *
                 vec4(lessThanEqual(abs(along - part), vec4(s.beyond)));
  opacity *= is_mine;
  // Behind the head there is only what it leaves of the pixel; in front of it a strand hides both alike.
  vec4 is_front = vec4(lessThan(z, p.depth + kSkinDepthM));
  vec4 share = (p.passed - (1.0 - is_front) * p.seen) * opacity;
  p.seen -= is_front * p.seen * opacity;
  p.red += share * (s.a.light.r + part * (s.b.light.r - s.a.light.r));
  p.green += share * (s.a.light.g + part * (s.b.light.g - s.a.light.g));
  p.blue += share * (s.a.light.b + part * (s.b.light.b - s.a.light.b));
  p.passed -= share;
}

// Depth of the farthest head in four pixels, 0 where there is none.
float head_depth(Pixels p) {
  vec4 depth = mix(p.depth, vec4(0.0), greaterThan(p.depth, vec4(0.5 * kFar)));
  return max(max(depth.x, depth.y), max(depth.z, depth.w));
}

// The most that is still seen of four pixels, of what lies behind the head (1) or anywhere (0).
float most_open(Pixels p, float behind) {
  vec4 open = p.passed - behind * p.seen;
  return max(max(open.x, open.y), max(open.z, open.w));
}

void write_pixels(Pixels p, ivec2 top) {
  for (int i = 0; i < 4; ++i) {
    ivec2 pixel = top + ivec2(0, i);
    if (any(greaterThanEqual(pixel, ivec2(u_frame.target.xy)))) continue;
    HeadPixel head = head_pixel(pixel);
    float seen = p.seen[i];
    vec3 scene = vec3(p.red[i], p.green[i], p.blue[i]) + (seen > 0.0 ? seen * head_light(head) : vec3(0.0));
    float drawn = 1.0 - p.passed[i] + seen;
#if HAS_BACKDROP == 1
    vec3 behind = linear_from_srgb(texelFetch(u_backdrop, pixel, 0).rgb);
#else
    vec3 behind = background_light(u_frame.background.rgb, 1.0 - p.y[i] / u_frame.target.y);
#endif
    vec3 color = mix(behind, tone_map(scene / max(drawn, 1e-5)), drawn);
    imageStore(u_picture, pixel, vec4(srgb_from_linear(clamp(color, 0.0, 1.0)), 1.0));
  }
}

void main() {
  uvec2 tile_at = uvec2(gl_WorkGroupID.x * kTilesPerGroup + gl_LocalInvocationID.y, gl_WorkGroupID.y);
  if (tile_at.x >= u_frame.grid.x) return;
  int tile = int(tile_at.y * u_frame.grid.x + tile_at.x);
  ivec2 top = ivec2(tile_at * uvec2(kTileColumns, kTileRows)) + ivec2(gl_LocalInvocationID.x, 0);
  // By name, not in an array: llvmpipe would keep that in memory.
  Pixels first = begin_pixels(top);
  Pixels second = begin_pixels(top + ivec2(0, 4));
  Pixels third = begin_pixels(top + ivec2(0, 8));
  Pixels fourth = begin_pixels(top + ivec2(0, 12));
  int begin = int(texelFetch(u_first, tile).r);
  int end = min(int(texelFetch(u_first, tile + 1).r), begin + int(kMaxTileSegments));
  float x = float(top.x) + 0.5;
  // From here on all is behind the head, but for segments that are longer than this along the view.
  const float kLongM = 0.04;
  float head_end = max(max(head_depth(first), head_depth(second)), max(head_depth(third), head_depth(fourth))) + kLongM;
  for (int i = begin; i < end; ++i) {
    Segment s = segment_at(int(texelFetch(u_order, i).g));
    blend(s, x, first);
    blend(s, x, second);
    blend(s, x, third);
    blend(s, x, fourth);
    float behind = min(s.a.place.z, s.b.place.z) > head_end ? 1.0 : 0.0;
    float most = max(max(most_open(first, behind), most_open(second, behind)),
                     max(most_open(third, behind), most_open(fourth, behind)));
    if (most < kOpaque) break;
  }
  write_pixels(first, top);
  write_pixels(second, top + ivec2(0, 4));
  write_pixels(third, top + ivec2(0, 8));
  write_pixels(fourth, top + ivec2(0, 12));
}
