// Segments into the tiles that they touch, one invocation per segment: counted first, then, once the tiles know where
// their lists begin, put there in any order (tile_order.comp).
#pragma variant IS_FILLING 0 1
#include "render/tile_frame.glsl"
#include "render/tile_points.glsl"

layout(local_size_x = kStrandLocalSize) in;

layout(std430, binding = kBindingTileCounts) restrict buffer TileCounts {
  uint count[];   // (tiles) segments; while filling, where the next one goes
} b_counts;
#if IS_FILLING == 1
layout(std430, binding = kBindingTilePairs) restrict writeonly buffer TilePairs {
  uvec2 pair[];   // bits of the depths of both ends, summed; first point
} b_pairs;
#else
layout(std430, binding = kBindingTileTotals) restrict buffer TileTotals {
  uint total[];   // kTotal* (shared/tiles.h)
} b_totals;
#endif

void visit(uint tile, uint point, float depth) {
#if IS_FILLING == 1
  b_pairs.pair[atomicAdd(b_counts.count[tile], 1u)] = uvec2(floatBitsToUint(depth), point);
#else
  atomicAdd(b_counts.count[tile], 1u);
#endif
}

void main() {
  uint segment = gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * gl_NumWorkGroups.x * kStrandLocalSize;
  uint points = u_frame.followers.z;
  uint strand = segment / points;
  if (strand >= u_frame.grid.z) return;
  // Behind a strand's last point lies what another picture left there.
  if (segment - strand * points + 1u >= strand_numbers(strand).point_count) return;
  vec3 a = point_place(segment);
  vec3 b = point_place(segment + 1u);
  float width = max(unpackHalf2x16(texelFetch(u_points, int(2u * segment + 1u)).y).x,
                    unpackHalf2x16(texelFetch(u_points, int(2u * segment + 3u)).y).x);
  const float kHalfDiagonalPx = 0.70710678;  // of a pixel
  float reach = 0.5 * width + kHalfDiagonalPx;
  vec2 low = min(a.xy, b.xy) - reach;
  vec2 high = max(a.xy, b.xy) + reach;
  // Also false for what is no number.
  const float kFarPx = 1e7;
  bool is_near = abs(a.x) + abs(a.y) + abs(b.x) + abs(b.y) < kFarPx;
  bool is_number = !(isnan(a.x + b.x) || isnan(a.y + b.y) || isnan(a.z + b.z) || isinf(a.x + b.x) || isinf(a.y + b.y) || isinf(a.z + b.z));
  bool is_seen = is_near && a.z > u_frame.eye.w && b.z > u_frame.eye.w && high.x > 0.0 && high.y > 0.0 &&
                 low.x < u_frame.target.x && low.y < u_frame.target.y && (a.x != b.x || a.y != b.y);
#if IS_FILLING == 0
  if (is_seen) atomicAdd(b_totals.total[kTotalSegments], 1u);
  if (!is_number) atomicAdd(b_totals.total[kTotalNotFinite], 1u);
#endif
  if (!is_seen) return;
  const vec2 tile_px = vec2(kTileColumns, kTileRows);
  ivec2 tiles = ivec2(u_frame.grid.xy);
  ivec2 from = ivec2(clamp(low / tile_px, vec2(0.0), vec2(tiles - 1)));
  ivec2 to = ivec2(clamp(high / tile_px, vec2(0.0), vec2(tiles - 1)));
  // Of the tiles of a row, a slanted line touches those whose middle is near enough to it.
  vec2 way = b.xy - a.xy;
  vec2 across = vec2(-way.y, way.x) * inversesqrt(dot(way, way));
  float offset = dot(across, a.xy);
  float room = reach + 0.5 * dot(tile_px, abs(across));
  const float kLevel = 1e-4;
  float per_across = abs(across.x) > kLevel ? 1.0 / across.x : 0.0;
  for (int y = from.y; y <= to.y; ++y) {
    float middle = (offset - across.y * (float(y) + 0.5) * tile_px.y) * per_across;
    float half_span = room * abs(per_across);
    // Tiles whose middles lie in [middle - half_span, middle + half_span].
    int x0 = per_across == 0.0 ? from.x : max(from.x, int(ceil(max((middle - half_span) / tile_px.x - 0.5, -1.0))));
    int x1 = per_across == 0.0 ? to.x : min(to.x, int(floor(min((middle + half_span) / tile_px.x - 0.5, float(tiles.x)))));
    for (int x = x0; x <= x1; ++x) visit(uint(y * tiles.x + x), segment, a.z + b.z);
  }
}
