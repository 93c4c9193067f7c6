// Points of the drawn strands, one invocation per strand: Hermite curves through the key strands' vertices, between three
// of them for a follower, set apart by the style (lib/strand_style.glsl).
#include "render/tile_frame.glsl"
#include "lib/strand_style.glsl"

layout(local_size_x = kStrandLocalSize) in;

layout(binding = kUnitTileKeys) uniform samplerBuffer u_key_position;   // (vertex_count x key_count) head space
layout(binding = kUnitTileTriangles) uniform usamplerBuffer u_triangle; // three keys; w = 1: hair falls to different sides

layout(std430, binding = kBindingTilePoints) restrict writeonly buffer TilePoints {
  uvec4 texel[];   // (points x 2)
} b_points;
layout(std430, binding = kBindingTileStrands) restrict writeonly buffer TileStrands {
  uvec4 numbers[];
} b_strands;

vec3 key_vertex(uint vertex, uint key) { return texelFetch(u_key_position, int(vertex * u_frame.strands.y + key)).xyz; }

// A cubic as it runs through one gap: p0 + t (m0 + t (c2 + t c3)).
struct Cubic {
  vec3 p0;
  vec3 m0;
  vec3 c2;
  vec3 c3;
};

Cubic key_cubic(uint key, uint gap) {
  uint last = u_frame.strands.z - 1u;
  vec3 p0 = key_vertex(gap, key);
  vec3 p1 = key_vertex(gap + 1u, key);
  vec3 before = key_vertex(gap == 0u ? 0u : gap - 1u, key);
  vec3 behind = key_vertex(min(gap + 2u, last), key);
  vec3 chord = p1 - p0;
  vec3 m0 = gap == 0u ? chord : 0.5 * (p1 - before);
  vec3 m1 = gap + 1u == last ? chord : 0.5 * (behind - p0);
  return Cubic(p0, m0, 3.0 * chord - 2.0 * m0 - m1, m0 + m1 - 2.0 * chord);
}

vec3 cubic_at(Cubic c, float t) { return c.p0 + t * (c.m0 + t * (c.c2 + t * c.c3)); }

StrandStyle frame_style() {
  return StrandStyle(u_frame.style[0].x, u_frame.style[0].y, u_frame.style[0].z, u_frame.style[0].w, u_frame.style[1].x,
                     u_frame.style[1].y, u_frame.style[1].z, u_frame.style[1].w, u_frame.style[2].x, u_frame.style[2].y,
                     u_frame.style[2].z);
}

void main() {
  uint strand = gl_GlobalInvocationID.x;
  if (strand >= u_frame.strands.x) return;
  uint key_count = u_frame.strands.y;
  bool is_key = strand < key_count;
  StrandStyle style = frame_style();

  // Which strand it is, and what it hangs between.
  uint drawn_index = is_key ? 0u : strand - key_count;
  uint triangle = drawn_index / max(u_frame.followers.x, 1u);
  uint follower = triangle * u_frame.followers.y + (drawn_index - triangle * u_frame.followers.x);
  uvec4 corners = is_key ? uvec4(strand, strand, strand, 0u) : texelFetch(u_triangle, int(triangle));
  uvec3 key = corners.xyz;
  uint index = is_key ? strand : key_count + follower;
  uint lock = is_key ? strand : lock_of(follower, triangle, style.locks);
  vec3 weights = is_key ? vec3(1.0, 0.0, 0.0) : spread_weights(follower);
  vec3 lock_weights = is_key ? weights : spread_weights(lock);
  vec3 aside = vec3(0.0);
  if (is_key) style.wave_m = 0.0;
  if (corners.w != 0u) {
    // It lies on the nearest key's side of the parting, and starts where it would have.
    uint nearest = weights.x >= weights.y && weights.x >= weights.z ? key.x : (weights.y >= weights.z ? key.y : key.z);
    aside = weights.x * key_vertex(0u, key.x) + weights.y * key_vertex(0u, key.y) + weights.z * key_vertex(0u, key.z) -
            key_vertex(0u, nearest);
    key = uvec3(nearest);
    weights = lock_weights = vec3(1.0, 0.0, 0.0);
  }

  DrawnStrand drawn = drawn_strand(index, lock, weights, lock_weights, style);
  uint per_gap = u_frame.strands.w;
  uint gaps = u_frame.strands.z - 1u;
  float reached = drawn.end * float(gaps * per_gap);
  uint whole = uint(reached);
  uint count = whole + (reached > float(whole) ? 2u : 1u);
  b_strands.numbers[strand] = uvec4(count, index, lock, 0u);

  uint point = strand * u_frame.followers.z;
  // A sample in front of the root, as far from it as the next one behind.
  vec3 before[3];
  for (int k = 0; k < 3; ++k) {
    Cubic first = key_cubic(key[k], 0u);
    before[k] = 2.0 * first.p0 - cubic_at(first, 1.0 / float(per_gap));
  }
  uint sample_index = 0u;
  for (uint gap = 0u; gap < gaps && sample_index < count; ++gap) {
    Cubic cubic[3];
    for (int k = 0; k < 3; ++k) cubic[k] = key_cubic(key[k], gap);
    // The last gap has its end as well.
    uint samples = gap + 1u == gaps ? per_gap + 1u : per_gap;
    for (uint j = 0u; j < samples && sample_index < count; ++j) {
      float t = float(j) / float(per_gap);
      float at = min(float(sample_index), reached);
      float along = at / reached;
      // The tip lies between two samples, all else on one.
      float part = clamp(at - (float(sample_index) - 1.0), 0.0, 1.0);
      vec3 here = cubic_at(cubic[0], t);
      vec3 tangent = here - before[0];
      vec3 w = weights_at(drawn, along);
      vec3 place = w.x * mix(before[0], here, part);
      before[0] = here;
      here = cubic_at(cubic[1], t);
      place += w.y * mix(before[1], here, part);
      before[1] = here;
      here = cubic_at(cubic[2], t);
      place += w.z * mix(before[2], here, part);
      before[2] = here;
      place += aside + deviation_m(drawn, style, along, tangent);
      b_points.texel[2u * (point + sample_index)] = uvec4(floatBitsToUint(place), 0u);
      ++sample_index;
    }
  }
}
