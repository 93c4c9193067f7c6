#include "common/render/tiles/strand_shading.h"

#include "common/render/passes/expand_pass.h"
#include "common/render/tiles/light_lookup.h"
#include "common/strands/strand_limits.h"

namespace strandcast {
namespace {

constexpr size_t kShadedStrandsPerRange = 16;
constexpr uint32_t kMaxPoints = (kMaxVertexCount - 1) * kMaxSegmentsPerGap + 2;

struct ShadeArguments {
  const ShadeInput* input;
  uint32_t begin, end;  // strands
  const uint32_t* first_point;
  const uint32_t* index;
  const uint32_t* lock;
  StrandPoint* point;
  uint32_t* tile;
};

/// As IEEE halves: rounded to the nearest, at most 65,504.
STRANDCAST_LANES simd::UintBits half_bits(simd::Float x) {
  using namespace simd;
  constexpr float kHalfScale = 1.92592994e-34f;  // 2^-112: the difference of the two biases
  const UintBits sign = ((UintBits)x.v >> 16) & 0x8000u;
  const Float size = min(abs(x), 65504.0f) * kHalfScale;
  return sign | (((UintBits)size.v + 0x1000u) >> 13);
}

/// 1 where a place in head space may be seen, 0 where the lattice says that it is hidden.
STRANDCAST_LANES simd::Float seen_at(const LightLatticeView& view, law::vec3 point) {
  const float scale = 0.5f / view.cell_m;
  const law::vec3 halved((dot(point, law::vec3(view.axis[0])) - view.origin_m.x) * scale - 0.25f,
                         (dot(point, law::vec3(view.axis[1])) - view.origin_m.y) * scale - 0.25f,
                         (dot(point, law::vec3(view.axis[2])) - view.origin_m.z) * scale - 0.25f);
  const LatticePlace place = lattice_place(halved, view.half_size);
  float seen[simd::kLanes];
  for (uint32_t lane = 0; lane < simd::kLanes; ++lane)
    seen[lane] = view.hidden[place.offset[lane]] != 0 ? 0.0f : 1.0f;
  return simd::load_lanes(seen);
}

/// The tile of a segment (StrandPoints::tile) by the places of its ends.
STRANDCAST_LANES simd::UintBits tile_of(const View& view, law::vec3 a, law::vec3 b, simd::Float reach) {
  using namespace simd;
  constexpr float kPerTile = 1.0f / static_cast<float>(kTilePx);
  constexpr float kFarPx = 1e7f;
  const auto tiles = [](float px) STRANDCAST_LANES_LAMBDA { return floorf((px - 1.0f) * kPerTile); };
  const float last_x = tiles(view.target_px.x), last_y = tiles(view.target_px.y);
  const Float low_x = min(a.x, b.x) - reach, high_x = max(a.x, b.x) + reach;
  const Float low_y = min(a.y, b.y) - reach, high_y = max(a.y, b.y) + reach;
  const Bool is_near = abs(a.x) + abs(a.y) + abs(b.x) + abs(b.y) < kFarPx && abs(a.z) + abs(b.z) < kFarPx;
  const Bool is_off = high_x <= 0.0f || high_y <= 0.0f || low_x >= view.target_px.x ||
                      low_y >= view.target_px.y || a.z <= view.near_m || b.z <= view.near_m ||
                      (a.x == b.x && a.y == b.y);
  const IntBits x = to_integers(clamp(low_x * kPerTile, 0.0f, last_x));
  const IntBits y = to_integers(clamp(low_y * kPerTile, 0.0f, last_y));
  const IntBits is_one = (x == to_integers(clamp(high_x * kPerTile, 0.0f, last_x))) &
                         (y == to_integers(clamp(high_y * kPerTile, 0.0f, last_y)));
  const UintBits one = (UintBits)(y * static_cast<int32_t>(last_x + 1.0f) + x);
  const UintBits several = UintBits{} + StrandPoints::kSeveralTiles;
  const UintBits tile = is_one ? one : several;
  return is_near.v ? (is_off.v ? UintBits{} + StrandPoints::kNoTile : tile) : several;
}

/// Room for one strand, with a lane's worth before and behind.
using StrandRow = float[kMaxPoints + 3 * simd::kLanes];

STRANDCAST_LANES void shade_strand_points_lanes(const ShadeArguments& a) {
  using namespace law;
  const ShadeInput& in = *a.input;
  const HairLook look = hair_look(in.look);
  const HairLights lights = hair_lights(in.look, in.lights);
  const glm::mat4& clip = in.view.clip_from_head;
  const vec3 eye(in.view.eye_m);
  const float half_width = 0.5f * in.view.target_px.x;
  const float half_height = 0.5f * in.view.target_px.y;
  constexpr uint32_t kFirst = kLanes;  // of a row
  StrandRow xs, ys, zs, dx, dy, aways, widths, seens;
  for (uint32_t strand = a.begin; strand < a.end; ++strand) {
    const uint32_t first = a.first_point[strand];
    const uint32_t count = a.first_point[strand + 1] - first;
    StrandPoint* const points = a.point + first;
    for (uint32_t k = 0; k < count; ++k) {
      xs[kFirst + k] = points[k].x;
      ys[kFirst + k] = points[k].y;
      zs[kFirst + k] = points[k].z;
    }
    const auto extend = [&](StrandRow & row) __attribute__((always_inline)) {
      row[kFirst - 1] = row[kFirst];
      for (uint32_t k = count; k < count + kLanes + 1; ++k) row[kFirst + k] = row[kFirst + count - 1];
    };
    extend(xs);
    extend(ys);
    extend(zs);
    const HairStrand hair = hair_strand(Uint(a.index[strand]), Uint(a.lock[strand]), look);
    const Float along_step = 1.0f / static_cast<float>(count > 1 ? count - 1 : 1);
    for (uint32_t k = 0; k < count; k += kLanes) {
      const uint32_t at = kFirst + k;
      const vec3 position(load_lanes(xs + at), load_lanes(ys + at), load_lanes(zs + at));
      const Float along = min((lane_numbers() + Float(static_cast<float>(k))) * along_step, 1.0f);
      const Float clip_x =
          clip[0][0] * position.x + clip[1][0] * position.y + clip[2][0] * position.z + clip[3][0];
      const Float clip_y =
          clip[0][1] * position.x + clip[1][1] * position.y + clip[2][1] * position.z + clip[3][1];
      const Float away =
          clip[0][3] * position.x + clip[1][3] * position.y + clip[2][3] * position.z + clip[3][3];
      const Float per_away = 1.0f / max(away, in.view.near_m);
      store_lanes(half_width + half_width * clip_x * per_away, dx + at);
      store_lanes(half_height - half_height * clip_y * per_away, dy + at);
      store_lanes(away, aways + at);
      store_lanes(in.width_m * in.view.focal_px * (1.0f + (in.tip_scale - 1.0f) * along * along) * per_away,
                  widths + at);
      store_lanes(in.lattice.hidden != nullptr ? seen_at(in.lattice, position) : Float(1.0f), seens + at);
    }
    extend(dx);
    extend(dy);
    extend(aways);
    extend(widths);
    extend(seens);
    const bool counts = in.debug_view == DebugView::Overdraw;
    for (uint32_t k = 0; k < count; k += kLanes) {
      const uint32_t at = kFirst + k;
      const Float along = min((lane_numbers() + Float(static_cast<float>(k))) * along_step, 1.0f);
      const Float x = load_lanes(dx + at);
      const Float y = load_lanes(dy + at);
      const Float away = load_lanes(aways + at);
      const Float width = load_lanes(widths + at);
      // What neither leads to nor comes from a place on the picture is not lit; tile_bins.cpp leaves it out.
      constexpr float kHalfDiagonalPx = 0.7072f;
      constexpr float kRoomPx = 1.0f;  // more than half a pixel's diagonal, and than halves round widths
      const Float reach =
          0.501f * max(width, max(load_lanes(widths + at - 1), load_lanes(widths + at + 1))) + kRoomPx;
      const Float before_x = load_lanes(dx + at - 1), behind_x = load_lanes(dx + at + 1);
      const Float before_y = load_lanes(dy + at - 1), behind_y = load_lanes(dy + at + 1);
      const Bool is_off =
          max(x, max(before_x, behind_x)) + reach < 0.0f || max(y, max(before_y, behind_y)) + reach < 0.0f ||
          min(x, min(before_x, behind_x)) - reach > in.view.target_px.x ||
          min(y, min(before_y, behind_y)) - reach > in.view.target_px.y || away <= in.view.near_m ||
          max(load_lanes(seens + at), max(load_lanes(seens + at - 1), load_lanes(seens + at + 1))) == 0.0f;
      vec3 light(0.0f);
      if (is_any(!is_off)) {
        const vec3 position(load_lanes(xs + at), load_lanes(ys + at), load_lanes(zs + at));
        const vec3 tangent = unit_or(vec3(load_lanes(xs + at + 1) - load_lanes(xs + at - 1),
                                          load_lanes(ys + at + 1) - load_lanes(ys + at - 1),
                                          load_lanes(zs + at + 1) - load_lanes(zs + at - 1)),
                                     vec3(0.0f, -1.0f, 0.0f));
        const vec3 to_eye = unit_or(eye - position, vec3(0.0f, 0.0f, 1.0f));
        const LightDepth depth = light_depth_at(in.lattice, position);
        light = hair_radiance(look, hair, lights, depth, along, tangent, to_eye);
        if (in.debug_view == DebugView::Tangents) light = 0.5f * tangent + vec3(0.5f);
        if (in.debug_view == DebugView::Shadow) light = vec3(kDebugWhite * exp(-depth.key));
        if (counts) light = vec3(kDebugWhite);
      }
      const Float opacity =
          counts ? Float(1.0f / kOverdrawLayers) : strand_cover(along, along_step, in.tip_fade);
      const UintBits tile =
          tile_of(in.view, vec3(x, y, away), vec3(behind_x, behind_y, load_lanes(aways + at + 1)),
                  0.501f * max(width, load_lanes(widths + at + 1)) + kHalfDiagonalPx);
      const Bool is_hidden = max(load_lanes(seens + at), load_lanes(seens + at + 1)) == 0.0f;
      const UintBits tile_bits = is_hidden.v ? UintBits{} + StrandPoints::kNoTile : tile;
      const UintBits width_bits = half_bits(width);
      const UintBits opacity_bits = half_bits(opacity);
      const UintBits red = half_bits(light.x);
      const UintBits green = half_bits(light.y);
      const UintBits blue = half_bits(light.z);
      const uint32_t lanes = count - k < kLanes ? count - k : kLanes;
      for (uint32_t lane = 0; lane < lanes; ++lane) {
        StrandPoint& point = points[k + lane];
        point.x = x.v[lane];
        point.y = y.v[lane];
        point.z = away.v[lane];
        point.half[kWidthPx] = static_cast<uint16_t>(width_bits[lane]);
        point.half[kOpacity] = static_cast<uint16_t>(opacity_bits[lane]);
        point.half[kRed] = static_cast<uint16_t>(red[lane]);
        point.half[kGreen] = static_cast<uint16_t>(green[lane]);
        point.half[kBlue] = static_cast<uint16_t>(blue[lane]);
        a.tile[first + k + lane] = tile_bits[lane];
      }
    }
    // Joints: across the mean of the directions before and behind.
    for (uint32_t k = 0; k < count; k += kLanes) {
      const uint32_t at = kFirst + k;
      const Float x = load_lanes(dx + at);
      const Float y = load_lanes(dy + at);
      vec2 before(x - load_lanes(dx + at - 1), y - load_lanes(dy + at - 1));
      vec2 behind(load_lanes(dx + at + 1) - x, load_lanes(dy + at + 1) - y);
      const Float before2 = dot(before, before);
      const Float behind2 = dot(behind, behind);
      constexpr float kNoWay = 1e-4f;  // squared pixels; what is shorter points anywhere
      before = before * vec2(select(before2 > kNoWay, inversesqrt(max(before2, kNoWay)), 0.0f));
      behind = behind * vec2(select(behind2 > kNoWay, inversesqrt(max(behind2, kNoWay)), 0.0f));
      const vec2 sum = before + behind;
      // A strand that turns back has no mitre: it is cut across its longer side, which hides the other one.
      const Bool turns = dot(sum, sum) < 0.03f;
      const Bool is_before = before2 > behind2;
      const UintBits mitre_x = half_bits(select(turns, select(is_before, before.x, behind.x), sum.x));
      const UintBits mitre_y = half_bits(select(turns, select(is_before, before.y, behind.y), sum.y));
      const uint32_t lanes = count - k < kLanes ? count - k : kLanes;
      for (uint32_t lane = 0; lane < lanes; ++lane) {
        points[k + lane].half[kMitreX] = static_cast<uint16_t>(mitre_x[lane]);
        points[k + lane].half[kMitreY] = static_cast<uint16_t>(mitre_y[lane]);
      }
    }
  }
}
STRANDCAST_KERNEL(shade_strand_points, ShadeArguments);

}  // namespace

void shade_points(const ShadeInput& input, WorkerPool& workers, simd::InstructionSet set,
                  StrandPoints& points) {
  points.tile.resize(points.point.size());
  workers.at(Priority::Drawing)
      .for_ranges(points.strand_count(), kShadedStrandsPerRange, [&](size_t begin, size_t end) {
        shade_strand_points(
            set, {&input, static_cast<uint32_t>(begin), static_cast<uint32_t>(end), points.first_point.data(),
                  points.index.data(), points.lock.data(), points.point.data(), points.tile.data()});
      });
}

}  // namespace strandcast
