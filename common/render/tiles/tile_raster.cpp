#include "common/render/tiles/tile_raster.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "common/render/tiles/light_lookup.h"
#include "common/render/tiles/tile_blend.h"

namespace strandcast {
namespace {

using simd::Bool;
using simd::Float;
using simd::FloatBits;
using simd::IntBits;
using simd::kLanes;

constexpr uint32_t kPairsBetweenChecks = 32;
// The background is lighter at the top of the picture and darker at its bottom by this share.
constexpr float kGradient = 0.35f;
// Samples of the head per pixel side.
constexpr int kHeadSamples = 2;
constexpr float kFarDepth = 1e30f;
constexpr uint32_t kNoTriangle = 0xffffffffu;

// ---- the head

constexpr int kHeadSidePx = kTileSidePx * kHeadSamples;
constexpr int kHeadRowBlocks = kHeadSidePx / kBlockColumns;
constexpr int kHeadBlocks = kHeadRowBlocks * (kHeadSidePx / kBlockRows);
constexpr float kHeadStep = 1.0f / kHeadSamples;

/// What the head's samples in a tile see.
struct HeadSamples {
  Float depth[kHeadBlocks];
  simd::UintBits which[kHeadBlocks];  // triangle
};

/// Returns false where no triangle is near the tile.
STRANDCAST_LANES bool sample_head(const TileInput& in, uint32_t tile, HeadSamples& samples) {
  const TileLists<uint32_t>& lists = in.bins->boxes();
  const uint32_t begin = lists.first[tile];
  const uint32_t end = lists.first[tile + 1];
  if (begin == end) return false;
  const HeadPicture& head = *in.head;
  for (int i = 0; i < kHeadBlocks; ++i) {
    samples.depth[i] = kFarDepth;
    samples.which[i] = simd::UintBits{} + kNoTriangle;
  }
  const auto tile_x = static_cast<float>(tile % in.grid.columns() * kTilePx);
  const auto tile_y = static_cast<float>(tile / in.grid.columns() * kTilePx);
  for (uint32_t j = begin; j < end; ++j) {
    const uint32_t triangle = lists.item[j];
    const glm::uvec3& corner = head.mesh->triangle[triangle];
    const glm::vec4& a = head.screen[corner.x];
    const glm::vec4& b = head.screen[corner.y];
    const glm::vec4& c = head.screen[corner.z];
    const float area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    if (!(area != 0.0f)) continue;
    const Float per_area = 1.0f / area;
    const glm::vec4& box = head.box[triangle];
    const int x0 = std::max(0, static_cast<int>((box.x - tile_x) * kHeadSamples) / kBlockColumns);
    const int x1 =
        std::min(kHeadRowBlocks - 1, static_cast<int>((box.z - tile_x) * kHeadSamples) / kBlockColumns);
    const int y0 = std::max(0, static_cast<int>((box.y - tile_y) * kHeadSamples) / kBlockRows);
    const int y1 = std::min(kHeadSidePx / kBlockRows - 1,
                            static_cast<int>((box.w - tile_y) * kHeadSamples) / kBlockRows);
    for (int y = y0; y <= y1; ++y)
      for (int x = x0; x <= x1; ++x) {
        const Float px =
            Float(tile_x) + (block_columns() + static_cast<float>(x * kBlockColumns)) * kHeadStep;
        const Float py = Float(tile_y) + (block_rows() + static_cast<float>(y * kBlockRows)) * kHeadStep;
        // The other way round an edge gives the same number with the other sign: neighbours leave no gap.
        const Float w0 = ((b.x - px) * (c.y - py) - (b.y - py) * (c.x - px)) * per_area;
        const Float w1 = ((c.x - px) * (a.y - py) - (c.y - py) * (a.x - px)) * per_area;
        const Float w2 = ((a.x - px) * (b.y - py) - (a.y - py) * (b.x - px)) * per_area;
        const Bool is_inside = w0 >= 0.0f && w1 >= 0.0f && w2 >= 0.0f;
        if (!is_any(is_inside)) continue;
        const int block = y * kHeadRowBlocks + x;
        const Float z = 1.0f / (w0 * a.w + w1 * b.w + w2 * c.w);
        const Bool is_nearest = is_inside && z < samples.depth[block];
        samples.depth[block] = select(is_nearest, z, samples.depth[block]);
        samples.which[block] = is_nearest.v ? simd::UintBits{} + triangle : samples.which[block];
      }
  }
  return true;
}

/// Returns where the first sample of a pixel lies among those of the tile. All of a pixel lie in one block.
STRANDCAST_LANES int first_sample(int x, int y) {
  static_assert(kBlockColumns % kHeadSamples == 0 && kBlockRows % kHeadSamples == 0);
  const int sample_x = x * kHeadSamples;
  const int sample_y = y * kHeadSamples;
  return (sample_y / kBlockRows * kHeadRowBlocks + sample_x / kBlockColumns) * static_cast<int>(kLanes) +
         sample_y % kBlockRows * kBlockColumns + sample_x % kBlockColumns;
}

/// Of a block of samples, which is a pixel above another: lanes 0 and 4 become the least, or the sum, of
/// each.
template <class Join>
STRANDCAST_LANES FloatBits joined_pixels(FloatBits samples, Join join) {
  samples = join(samples, __builtin_shufflevector(samples, samples, 1, 0, 3, 2, 5, 4, 7, 6));
  return join(samples, __builtin_shufflevector(samples, samples, 2, 3, 0, 1, 6, 7, 4, 5));
}
/// Returns the pixels of a block: of its samples upper left and right, lower left and right.
template <class Join>
STRANDCAST_LANES Float pixels_of(const FloatBits samples[4], Join join) {
  FloatBits joined[4];
  for (int i = 0; i < 4; ++i) joined[i] = joined_pixels(samples[i], join);
  const FloatBits upper = __builtin_shufflevector(joined[0], joined[1], 0, 8, 4, 12, 0, 8, 4, 12);
  const FloatBits lower = __builtin_shufflevector(joined[2], joined[3], 0, 8, 4, 12, 0, 8, 4, 12);
  return __builtin_shufflevector(upper, lower, 0, 1, 2, 3, 8, 9, 10, 11);
}

/// How far the head is from pixels and how much of each it covers; false where it covers nothing.
STRANDCAST_LANES bool cover_by_head(const HeadSamples& samples, TileHead& out) {
  static_assert(kHeadSamples == 2 && kBlockColumns == 2 && kBlockRows == 4);
  constexpr float kShare = 1.0f / (kHeadSamples * kHeadSamples);
  bool is_there = false;
  for (int y = 0; y < kBlocksDown; ++y)
    for (int x = 0; x < kBlocksAcross; ++x) {
      const int block = y * kBlocksAcross + x;
      const Float* const upper = samples.depth + 2 * (y * kHeadRowBlocks + x);
      const FloatBits depth[4] = {upper[0].v, upper[1].v, upper[kHeadRowBlocks].v,
                                  upper[kHeadRowBlocks + 1].v};
      FloatBits share[4];
      for (int i = 0; i < 4; ++i)
        share[i] = select(Float(depth[i]) < kFarDepth, Float(kShare), Float(0.0f)).v;
      out.depth[block] = pixels_of(depth, [](FloatBits a, FloatBits b) STRANDCAST_LANES_LAMBDA {
        return simd::min(Float(a), Float(b)).v;
      });
      out.seen[block] =
          pixels_of(share, [](FloatBits a, FloatBits b) STRANDCAST_LANES_LAMBDA { return a + b; });
      is_there |= is_any(out.seen[block] > 0.0f);
    }
  return is_there;
}

/// The head's light in a block of pixels, each that of its first covered sample.
STRANDCAST_LANES law::vec3 light_head(const TileInput& in, uint32_t tile, const HeadSamples& samples, int x,
                                      int y) {
  const HeadPicture& head = *in.head;
  const ShadeInput& shade = *in.shade;
  const auto* const triangles = reinterpret_cast<const uint32_t*>(samples.which);
  const auto tile_x = static_cast<float>(tile % in.grid.columns() * kTilePx);
  const auto tile_y = static_cast<float>(tile / in.grid.columns() * kTilePx);
  float seen_x[kLanes], seen_y[kLanes];
  float corner_x[3][kLanes], corner_y[3][kLanes], corner_w[3][kLanes];
  float value[3][7][kLanes];  // position, normal, cover
  for (int lane = 0; lane < static_cast<int>(kLanes); ++lane) {
    const int pixel_x = x * kBlockColumns + lane % kBlockColumns;
    const int pixel_y = y * kBlockRows + lane / kBlockColumns;
    const int first = first_sample(pixel_x, pixel_y);
    uint32_t triangle = kNoTriangle;
    seen_x[lane] = seen_y[lane] = 0.0f;
    for (int sample = 0; sample < kHeadSamples * kHeadSamples && triangle == kNoTriangle; ++sample) {
      triangle = triangles[first + sample / kHeadSamples * kBlockColumns + sample % kHeadSamples];
      if (triangle == kNoTriangle) continue;
      seen_x[lane] =
          tile_x + (static_cast<float>(pixel_x * kHeadSamples + sample % kHeadSamples) + 0.5f) * kHeadStep;
      seen_y[lane] =
          tile_y + (static_cast<float>(pixel_y * kHeadSamples + sample / kHeadSamples) + 0.5f) * kHeadStep;
    }
    const glm::uvec3& corner = head.mesh->triangle[triangle != kNoTriangle ? triangle : 0];
    for (int c = 0; c < 3; ++c) {
      const glm::vec4& screen = head.screen[corner[c]];
      corner_x[c][lane] = screen.x;
      corner_y[c][lane] = screen.y;
      corner_w[c][lane] = screen.w;
      const glm::vec3& position = head.mesh->position_m[corner[c]];
      const glm::vec3& normal = head.mesh->normal[corner[c]];
      for (int axis = 0; axis < 3; ++axis) {
        value[c][axis][lane] = position[axis];
        value[c][3 + axis][lane] = normal[axis];
      }
      value[c][6][lane] = (*head.cover)[corner[c]];
    }
  }
  // Weights in space: those on the screen, each over its depth.
  Float off_x[3], off_y[3], weight[3], mean[7];
  for (int c = 0; c < 3; ++c) {
    off_x[c] = simd::load_lanes(corner_x[c]) - simd::load_lanes(seen_x);
    off_y[c] = simd::load_lanes(corner_y[c]) - simd::load_lanes(seen_y);
  }
  for (int c = 0; c < 3; ++c)
    weight[c] = (off_x[(c + 1) % 3] * off_y[(c + 2) % 3] - off_y[(c + 1) % 3] * off_x[(c + 2) % 3]) *
                simd::load_lanes(corner_w[c]);
  const Float per_sum = 1.0f / (weight[0] + weight[1] + weight[2]);
  for (int i = 0; i < 7; ++i)
    mean[i] = (weight[0] * simd::load_lanes(value[0][i]) + weight[1] * simd::load_lanes(value[1][i]) +
               weight[2] * simd::load_lanes(value[2][i])) *
              per_sum;
  const law::vec3 position(mean[0], mean[1], mean[2]);
  const law::vec3 normal = law::unit_or(law::vec3(mean[3], mean[4], mean[5]), law::vec3(0.0f, 0.0f, 1.0f));
  const law::vec3 to_eye = law::unit_or(law::vec3(shade.view.eye_m) - position, law::vec3(0.0f, 0.0f, 1.0f));
  const law::LightDepth light = light_depth_at(shade.lattice, position + head.shadow_lift_m * normal);
  return law::skin_radiance(shade.look.skin_color, shade.look.root_color,
                            hair_lights(shade.look, shade.lights), light, normal, to_eye, mean[6]);
}

// ---- strands

/// Segments of a tile from front to back: `order` has, in its lower half, the first of two ends.
struct SortedSegments {
  const StrandPoint* end;
  const uint64_t* order;
  uint32_t count;
};

/// Sorts the segments of a tile by the depth of their middles, then by their number; without those that lie
/// wholly beyond `hidden`. Their ends are copied here, where they are read as they lie in memory, and then
/// found in a cache in any order.
STRANDCAST_LANES SortedSegments sort_segments(const TileInput& in, uint32_t begin, uint32_t count,
                                              float hidden, TileScratch& scratch) {
  const TileSegment* const items = in.bins->segments().item.data() + begin;
  const StrandPoint* const points = in.points->point.data();
  scratch.order.resize(count);
  scratch.sorted.resize(count);
  scratch.end.resize(size_t{2} * count);
  float low = kFarDepth;
  float high = -kFarDepth;
  for (uint32_t i = 0; i < count; ++i) {
    low = std::min(low, items[i].depth);
    high = std::max(high, items[i].depth);
  }
  constexpr float kDepthSteps = 65535.0f;
  const float scale = kDepthSteps / std::max(high - low, 1e-9f);
  uint32_t counts[2][256] = {};
  uint32_t kept = 0;
  for (uint32_t i = 0; i < count; ++i) {
    constexpr uint32_t kAhead = 16;
    const StrandPoint* const later = points + items[std::min(i + kAhead, count - 1)].point;
    __builtin_prefetch(later);
    __builtin_prefetch(later + 1);
    const StrandPoint* const ends = points + items[i].point;
    if (std::min(ends[0].z, ends[1].z) > hidden) continue;
    std::memcpy(scratch.end.data() + 2 * kept, ends, 2 * sizeof *ends);
    const float step = std::min((items[i].depth - low) * scale, kDepthSteps);
    const auto key = static_cast<uint32_t>(static_cast<int32_t>(step));
    scratch.order[kept] = uint64_t{key} << 32 | 2 * kept;
    ++kept;
    ++counts[0][key & 255];
    ++counts[1][key >> 8];
  }
  uint64_t* from = scratch.order.data();
  uint64_t* to = scratch.sorted.data();
  for (int pass = 0; pass < 2; ++pass) {
    uint32_t sum = 0;
    for (uint32_t& entry : counts[pass]) {
      const uint32_t here = entry;
      entry = sum;
      sum += here;
    }
    const int shift = 32 + 8 * pass;
    for (uint32_t i = 0; i < kept; ++i) to[counts[pass][from[i] >> shift & 255]++] = from[i];
    std::swap(from, to);
  }
  return {scratch.end.data(), from, kept};
}

STRANDCAST_LANES Float tone_mapped(Float linear) {
  // shaders/lib/tone.glsl
  constexpr float kKnee = 0.7f;
  constexpr float kRoom = 1.0f - kKnee;
  const Float over = simd::max(linear - kKnee, 0.0f);
  return simd::min(linear, kKnee) + kRoom * over / (over + kRoom);
}

/// `middle`: of a row, px from the top.
STRANDCAST_LANES Float background_gradient(const TileInput& in, Float middle) {
  const Float high = 1.0f - middle / static_cast<float>(in.grid.size_px.y);
  return 1.0f + kGradient * (2.0f * high - 1.0f);
}

STRANDCAST_LANES void fill_background(const TileInput& in, uint32_t tile) {
  const uint32_t left = tile % in.grid.columns() * kTilePx;
  const uint32_t top = tile / in.grid.columns() * kTilePx;
  const uint32_t width = std::min(kTilePx, in.grid.size_px.x - left);
  const uint32_t height = std::min(kTilePx, in.grid.size_px.y - top);
  for (uint32_t y = 0; y < height; ++y) {
    const size_t first = 4 * (size_t{top + y} * in.grid.size_px.x + left);
    if (in.backdrop != nullptr) {
      std::memcpy(in.rgba + first, in.backdrop + first, size_t{4} * width);
      continue;
    }
    const glm::vec3 color = in.background * background_gradient(in, static_cast<float>(top + y) + 0.5f).v[0];
    uint32_t packed = 0xff000000u;
    for (int c = 0; c < 3; ++c) {
      const auto step = static_cast<int>(std::clamp(color[c], 0.0f, 1.0f) * kSrgbSteps);
      packed |= uint32_t{in.srgb[step]} << (8 * c);
    }
    for (uint32_t x = 0; x < width; ++x) std::memcpy(in.rgba + first + 4 * x, &packed, sizeof packed);
  }
}

/// What lies behind a block of pixels whose first is `left`, `top`. Those beyond the picture's edge, which
/// nobody sees, are as its last ones.
STRANDCAST_LANES void read_backdrop(const TileInput& in, uint32_t left, uint32_t top, Float color[3]) {
  alignas(alignof(Float)) float value[3][kLanes];
  for (uint32_t lane = 0; lane < kLanes; ++lane) {
    const uint32_t x = std::min(left + lane % kBlockColumns, in.grid.size_px.x - 1);
    const uint32_t y = std::min(top + lane / kBlockColumns, in.grid.size_px.y - 1);
    const uint8_t* const pixel = in.backdrop + 4 * (size_t{y} * in.grid.size_px.x + x);
    for (int c = 0; c < 3; ++c) value[c][lane] = in.linear[pixel[c]];
  }
  for (int c = 0; c < 3; ++c) color[c] = simd::load_lanes(value[c]);
}

/// The strands of a tile from front to back; `head`: null where there is none.
STRANDCAST_LANES void blend_strands(const TileInput& in, uint32_t tile, TileHead* head, TileScratch& scratch,
                                    TilePixels& pixels) {
  const uint32_t begin = in.bins->segments().first[tile];
  const uint32_t count = in.bins->segments().first[tile + 1] - begin;
  if (count == 0) return;
  const auto left = static_cast<float>(tile % in.grid.columns() * kTilePx);
  const auto top = static_cast<float>(tile / in.grid.columns() * kTilePx);
  // Segments are sorted by their middles, and few are longer than this along the view.
  constexpr float kLongM = 0.04f;
  const SortedSegments sorted =
      sort_segments(in, begin, count, head != nullptr ? head->hides_all : kNothingHidden, scratch);
  for (int y = 0; y < kBlocksDown; ++y) pixels.open[y] = (uint32_t{1} << kBlocksAcross) - 1;
  uint32_t until_check = kPairsBetweenChecks;
  for (uint32_t i = 0; i < sorted.count; i += kLanes) {
    const uint32_t found = std::min(kLanes, sorted.count - i);
    SegmentBatch batch;
    place_segments(sorted.end, sorted.order + i, found, left, top, batch);
    for (uint32_t lane = 0; lane < found; ++lane) blend_segment(batch, lane, head, pixels);
    until_check -= std::min(until_check, kLanes);
    if (until_check > 0) continue;
    until_check = kPairsBetweenChecks;
    const StrandPoint* const last = sorted.end + static_cast<uint32_t>(sorted.order[i + found - 1]);
    const bool is_behind = head != nullptr && std::min(last[0].z, last[1].z) > head->end + kLongM;
    if (!close_opaque_blocks(is_behind ? head : nullptr, pixels)) break;
  }
}

/// Linear colours of a block as the picture has them.
STRANDCAST_LANES void pack_pixels(const TileInput& in, const Float color[3], uint32_t packed[kLanes]) {
  int32_t step[3][kLanes];
  for (int c = 0; c < 3; ++c) {
    const IntBits steps = to_integers(simd::clamp(color[c], 0.0f, 1.0f) * static_cast<float>(kSrgbSteps));
    std::memcpy(step[c], &steps, sizeof steps);
  }
  for (uint32_t lane = 0; lane < kLanes; ++lane)
    packed[lane] = 0xff000000u | uint32_t{in.srgb[step[0][lane]]} | uint32_t{in.srgb[step[1][lane]]} << 8 |
                   uint32_t{in.srgb[step[2][lane]]} << 16;
}

/// What is known of a tile when it is written; `head`: null where there is none.
struct DrawnTile {
  const TileInput& in;
  uint32_t tile;
  const TileHead* head;
  const HeadSamples& samples;
  const TilePixels& pixels;
};

/// Head and strands of a block over what lies behind, which `color` has.
STRANDCAST_LANES void add_drawn(const DrawnTile& drawn_tile, int x, int y, Float color[3]) {
  const auto& [in, tile, head, samples, pixels] = drawn_tile;
  const int block = y * kBlocksAcross + x;
  Float scene[3] = {pixels.red[block], pixels.green[block], pixels.blue[block]};
  Float drawn = 1.0f - pixels.passed[block];
  // Where strands leave less than this of the head nobody sees it.
  if (head != nullptr && is_any(head->seen[block] > kOpaque)) {
    const Float seen = head->seen[block];
    const law::vec3 light = light_head(in, tile, samples, x, y);
    scene[0] += seen * light.x;
    scene[1] += seen * light.y;
    scene[2] += seen * light.z;
    drawn += seen;
  }
  if (!is_any(drawn > 0.0f)) return;
  const Float per_drawn = 1.0f / simd::max(drawn, 1e-5f);
  for (int c = 0; c < 3; ++c) color[c] += drawn * (tone_mapped(scene[c] * per_drawn) - color[c]);
}

/// The picture's pixels of a tile: head and strands over the background, tone curve, sRGB.
STRANDCAST_LANES void write_pixels(const DrawnTile& drawn) {
  const TileInput& in = drawn.in;
  const uint32_t left = drawn.tile % in.grid.columns() * kTilePx;
  const uint32_t top = drawn.tile / in.grid.columns() * kTilePx;
  const uint32_t width = std::min(kTilePx, in.grid.size_px.x - left);
  const uint32_t height = std::min(kTilePx, in.grid.size_px.y - top);
  for (uint32_t y = 0; y < height; y += kBlockRows) {
    const Float gradient = background_gradient(in, block_rows() + static_cast<float>(top + y));
    for (uint32_t x = 0; x < width; x += kBlockColumns) {
      Float color[3] = {in.background.x * gradient, in.background.y * gradient, in.background.z * gradient};
      if (in.backdrop != nullptr) read_backdrop(in, left + x, top + y, color);
      add_drawn(drawn, static_cast<int>(x / kBlockColumns), static_cast<int>(y / kBlockRows), color);
      uint32_t packed[kLanes];
      pack_pixels(in, color, packed);
      const size_t columns = std::min<size_t>(kBlockColumns, width - x);
      for (uint32_t row = 0; row < std::min<uint32_t>(kBlockRows, height - y); ++row)
        std::memcpy(in.rgba + 4 * (size_t{top + y + row} * in.grid.size_px.x + left + x),
                    packed + size_t{row} * kBlockColumns, columns * sizeof *packed);
    }
  }
}

STRANDCAST_LANES void draw_any_tile_lanes(const TileArguments& arguments) {
  const TileInput& in = *arguments.input;
  const uint32_t tile = arguments.tile;
  HeadSamples samples;
  TileHead head;
  const bool has_head =
      in.head->mesh != nullptr && sample_head(in, tile, samples) && cover_by_head(samples, head);
  const bool has_strands = in.bins->segments().first[tile + 1] > in.bins->segments().first[tile];
  if (!has_strands && !has_head) return fill_background(in, tile);
  if (has_head) find_hidden(head);
  TilePixels pixels;
  for (int block = 0; block < kBlocks; ++block) {
    pixels.red[block] = pixels.green[block] = pixels.blue[block] = Float(0.0f);
    pixels.passed[block] = Float(1.0f);
  }
  blend_strands(in, tile, has_head ? &head : nullptr, *arguments.scratch, pixels);
  write_pixels({in, tile, has_head ? &head : nullptr, samples, pixels});
}
STRANDCAST_KERNEL(draw_any_tile, TileArguments);

}  // namespace

void draw_tile(simd::InstructionSet set, const TileArguments& arguments) {
  draw_any_tile(set, arguments);
}

std::vector<uint8_t> make_srgb_table() {
  std::vector<uint8_t> table(kSrgbSteps + 1);
  for (uint32_t i = 0; i <= kSrgbSteps; ++i) {
    // sRGB transfer function, IEC 61966-2-1.
    const double linear = static_cast<double>(i) / kSrgbSteps;
    const double value = linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
    table[i] = static_cast<uint8_t>(std::lround(255.0 * value));
  }
  return table;
}

std::vector<float> make_linear_table(const std::vector<uint8_t>& srgb) {
  constexpr size_t kValues = 256;
  std::vector<uint32_t> sum(kValues), count(kValues);
  for (uint32_t step = 0; step < srgb.size(); ++step) {
    sum[srgb[step]] += step;
    ++count[srgb[step]];
  }
  std::vector<float> table(kValues);
  // A step holds what lies up to the next one.
  for (size_t value = 0; value < kValues; ++value)
    table[value] = (static_cast<float>(sum[value]) / static_cast<float>(std::max(count[value], 1u)) + 0.5f) /
                   static_cast<float>(kSrgbSteps);
  return table;
}

void place_head(const View& view, WorkerPool& workers, HeadPicture& head) {
  const Mesh& mesh = *head.mesh;
  head.screen.resize(mesh.position_m.size());
  constexpr size_t kVerticesPerRange = 512;
  workers.at(Priority::Drawing)
      .for_ranges(mesh.position_m.size(), kVerticesPerRange, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) {
          const glm::vec4 clip = view.clip_from_head * glm::vec4(mesh.position_m[i], 1.0f);
          const float per_away = 1.0f / std::max(clip.w, view.near_m);
          head.screen[i] = {view.target_px.x * (0.5f + 0.5f * clip.x * per_away),
                            view.target_px.y * (0.5f - 0.5f * clip.y * per_away), clip.w, per_away};
        }
      });
  head.box.resize(mesh.triangle.size());
  for (size_t i = 0; i < mesh.triangle.size(); ++i) {
    const glm::uvec3& corner = mesh.triangle[i];
    const glm::vec4& a = head.screen[corner.x];
    const glm::vec4& b = head.screen[corner.y];
    const glm::vec4& c = head.screen[corner.z];
    // Triangles that reach behind the eye are left out: a head is never that near.
    const bool is_seen = a.z > view.near_m && b.z > view.near_m && c.z > view.near_m;
    head.box[i] = is_seen ? glm::vec4(glm::min(glm::min(glm::vec2(a), glm::vec2(b)), glm::vec2(c)),
                                      glm::max(glm::max(glm::vec2(a), glm::vec2(b)), glm::vec2(c)))
                          : glm::vec4(1.0f, 1.0f, 0.0f, 0.0f);
  }
}

}  // namespace strandcast
