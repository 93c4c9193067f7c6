#include "common/render/tiles/tile_raster.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "common/render/tiles/half_float.h"
#include "common/render/tiles/light_lookup.h"

namespace strandcast {
namespace {

using simd::Bool;
using simd::Float;
using simd::FloatBits;
using simd::IntBits;
using simd::kLanes;

// Pixels that a vector holds.
constexpr int kBlockColumns = 4;
constexpr int kBlockRows = 2;
static_assert(kBlockColumns * kBlockRows == kLanes);
constexpr int kTile = static_cast<int>(kTilePx);
constexpr int kBlocksAcross = kTile / kBlockColumns;
constexpr int kBlocksDown = kTile / kBlockRows;
constexpr int kBlocks = kBlocksAcross * kBlocksDown;
// Light that still passes when a pixel counts as opaque.
constexpr float kOpaque = 1.0f / 300.0f;
constexpr uint32_t kPairsBetweenChecks = 24;
// Strands this far behind the skin are still in front of it: roots stand in it.
constexpr float kSkinDepthM = 0.0005f;
// The background is lighter at the top of the picture and darker at its bottom by this share.
constexpr float kGradient = 0.35f;
// Samples of the head per pixel side.
constexpr int kHeadSamples = 2;
constexpr float kFar = 1e30f;
constexpr uint32_t kNoTriangle = 0xffffffffu;

/// Of one tile, per pixel.
struct TilePixels {
  Float red[kBlocks];
  Float green[kBlocks];
  Float blue[kBlocks];
  Float passed[kBlocks];  // share of what lies behind that is still seen
};
struct TileHead {
  Float depth[kBlocks];      // m, nearest
  Float uncovered[kBlocks];  // share of the pixel
  Float red[kBlocks];
  Float green[kBlocks];
  Float blue[kBlocks];
};

STRANDCAST_LANES Float block_columns() {
  return FloatBits{0.5f, 1.5f, 2.5f, 3.5f, 0.5f, 1.5f, 2.5f, 3.5f};
}
STRANDCAST_LANES Float block_rows() {
  return FloatBits{0.5f, 0.5f, 0.5f, 0.5f, 1.5f, 1.5f, 1.5f, 1.5f};
}

// ---- the head

STRANDCAST_LANES bool draw_head(const TileInput& in, uint32_t tile, TileHead& out) {
  const TileLists<uint32_t>& lists = in.bins->boxes();
  const uint32_t begin = lists.first[tile];
  const uint32_t end = lists.first[tile + 1];
  if (begin == end) return false;
  const HeadPicture& head = *in.head;
  constexpr int kSide = kTile * kHeadSamples;
  constexpr int kRowBlocks = kSide / kBlockColumns;
  constexpr int kSampleBlocks = kRowBlocks * (kSide / kBlockRows);
  Float depth[kSampleBlocks];
  simd::UintBits which[kSampleBlocks];
  for (int i = 0; i < kSampleBlocks; ++i) {
    depth[i] = kFar;
    which[i] = simd::UintBits{} + kNoTriangle;
  }
  const auto tile_x = static_cast<float>(tile % in.grid.columns() * kTilePx);
  const auto tile_y = static_cast<float>(tile / in.grid.columns() * kTilePx);
  constexpr float kStep = 1.0f / kHeadSamples;
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
        std::min(kRowBlocks - 1, static_cast<int>((box.z - tile_x) * kHeadSamples) / kBlockColumns);
    const int y0 = std::max(0, static_cast<int>((box.y - tile_y) * kHeadSamples) / kBlockRows);
    const int y1 =
        std::min(kSide / kBlockRows - 1, static_cast<int>((box.w - tile_y) * kHeadSamples) / kBlockRows);
    for (int y = y0; y <= y1; ++y)
      for (int x = x0; x <= x1; ++x) {
        const Float px = Float(tile_x) + (block_columns() + static_cast<float>(x * kBlockColumns)) * kStep;
        const Float py = Float(tile_y) + (block_rows() + static_cast<float>(y * kBlockRows)) * kStep;
        // The other way round an edge gives the same number with the other sign: neighbours leave no gap.
        const Float w0 = ((b.x - px) * (c.y - py) - (b.y - py) * (c.x - px)) * per_area;
        const Float w1 = ((c.x - px) * (a.y - py) - (c.y - py) * (a.x - px)) * per_area;
        const Float w2 = ((a.x - px) * (b.y - py) - (a.y - py) * (b.x - px)) * per_area;
        const int block = y * kRowBlocks + x;
        const Float z = 1.0f / (w0 * a.w + w1 * b.w + w2 * c.w);
        const Bool is_nearest = w0 >= 0.0f && w1 >= 0.0f && w2 >= 0.0f && z < depth[block];
        if (!is_any(is_nearest)) continue;
        depth[block] = select(is_nearest, z, depth[block]);
        which[block] = is_nearest.v ? simd::UintBits{} + triangle : which[block];
      }
  }

  // A pixel has the light of its first covered sample, and covers what its samples do.
  const ShadeInput& shade = *in.shade;
  const law::HairLights lights = hair_lights(shade.look, shade.lights);
  const auto* const depths = reinterpret_cast<const float*>(depth);
  const auto* const triangles = reinterpret_cast<const uint32_t*>(which);
  bool is_there = false;
  for (int y = 0; y < kBlocksDown; ++y)
    for (int x = 0; x < kBlocksAcross; ++x) {
      const int block = y * kBlocksAcross + x;
      float nearest[kLanes], uncovered[kLanes], seen_x[kLanes], seen_y[kLanes];
      float corner_x[3][kLanes], corner_y[3][kLanes], corner_w[3][kLanes];
      float value[3][7][kLanes];  // position, normal, cover
      bool is_block = false;
      for (int lane = 0; lane < static_cast<int>(kLanes); ++lane) {
        const int sample_x = (x * kBlockColumns + lane % kBlockColumns) * kHeadSamples;
        const int sample_y = (y * kBlockRows + lane / kBlockColumns) * kHeadSamples;
        // The samples of a pixel are two pairs in one block.
        static_assert(kHeadSamples == kBlockRows);
        const int first =
            (sample_y / kBlockRows * kRowBlocks + sample_x / kBlockColumns) * static_cast<int>(kLanes) +
            sample_x % kBlockColumns;
        uint32_t triangle = kNoTriangle;
        int covered = 0;
        nearest[lane] = kFar;
        seen_x[lane] = seen_y[lane] = 0.0f;
        for (int sample = 0; sample < kHeadSamples * kHeadSamples; ++sample) {
          const int at = first + sample / kHeadSamples * kBlockColumns + sample % kHeadSamples;
          if (triangles[at] == kNoTriangle) continue;
          ++covered;
          nearest[lane] = std::min(nearest[lane], depths[at]);
          if (triangle != kNoTriangle) continue;
          triangle = triangles[at];
          seen_x[lane] = tile_x + (static_cast<float>(sample_x + sample % kHeadSamples) + 0.5f) * kStep;
          seen_y[lane] = tile_y + (static_cast<float>(sample_y + sample / kHeadSamples) + 0.5f) * kStep;
        }
        uncovered[lane] = 1.0f - static_cast<float>(covered) / (kHeadSamples * kHeadSamples);
        is_block |= covered > 0;
        const glm::uvec3& corner = head.mesh->triangle[covered > 0 ? triangle : 0];
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
      out.depth[block] = simd::load_lanes(nearest);
      out.uncovered[block] = simd::load_lanes(uncovered);
      out.red[block] = out.green[block] = out.blue[block] = Float(0.0f);
      if (!is_block) continue;
      is_there = true;
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
      const law::vec3 normal =
          law::unit_or(law::vec3(mean[3], mean[4], mean[5]), law::vec3(0.0f, 0.0f, 1.0f));
      const law::vec3 to_eye =
          law::unit_or(law::vec3(shade.view.eye_m) - position, law::vec3(0.0f, 0.0f, 1.0f));
      const law::LightDepth light = light_depth_at(shade.lattice, position + head.shadow_lift_m * normal);
      const law::vec3 color = law::skin_radiance(shade.look.skin_color, shade.look.root_color, lights, light,
                                                 normal, to_eye, mean[6]);
      out.red[block] = color.x;
      out.green[block] = color.y;
      out.blue[block] = color.z;
    }
  return is_there;
}

// ---- strands

/// The segments of a tile from front to back: by the depth of their middles, then by their number.
STRANDCAST_LANES const uint64_t* sort_segments(const TileInput& in, uint32_t begin, uint32_t count,
                                               TileScratch& scratch) {
  const TileSegment* const items = in.bins->segments().item.data() + begin;
  scratch.order.resize(count);
  scratch.sorted.resize(count);
  float low = kFar;
  float high = -kFar;
  for (uint32_t i = 0; i < count; ++i) {
    low = std::min(low, items[i].depth);
    high = std::max(high, items[i].depth);
  }
  constexpr float kDepthSteps = 65535.0f;
  const float scale = kDepthSteps / std::max(high - low, 1e-9f);
  uint32_t counts[2][256] = {};
  for (uint32_t i = 0; i < count; ++i) {
    const float step = std::min((items[i].depth - low) * scale, kDepthSteps);
    const auto key = static_cast<uint32_t>(static_cast<int32_t>(step));
    scratch.order[i] = uint64_t{key} << 32 | items[i].point;
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
    for (uint32_t i = 0; i < count; ++i) to[counts[pass][from[i] >> shift & 255]++] = from[i];
    std::swap(from, to);
  }
  return from;
}

/// The seven halves of a point as floats.
struct PointValues {
  float value[8];
};
STRANDCAST_LANES PointValues values_of(const StrandPoint& point) {
  using HalfBits = uint16_t __attribute__((vector_size(16)));
  HalfBits half;
  std::memcpy(&half, point.half.data(), sizeof half);
  constexpr float kFloatScale = 5.19229686e33f;  // as float_of_half
  const simd::UintBits bits = __builtin_convertvector(half, simd::UintBits);
  const FloatBits size = (FloatBits)((bits & 0x7fffu) << 13) * kFloatScale;
  const FloatBits value = (FloatBits)((simd::UintBits)size | (bits & 0x8000u) << 16);
  PointValues values;
  std::memcpy(values.value, &value, sizeof value);
  return values;
}

/// Blends one segment under what lies in front of it.
STRANDCAST_LANES void blend_segment(const StrandPoint& a, const StrandPoint& b, float tile_x, float tile_y,
                                    const TileHead* head, TilePixels& pixels) {
  const PointValues va = values_of(a);
  const PointValues vb = values_of(b);
  const float ax = a.x - tile_x;
  const float ay = a.y - tile_y;
  const float bx = b.x - tile_x;
  const float by = b.y - tile_y;
  const float dx = bx - ax;
  const float dy = by - ay;
  const float per_length2 = 1.0f / (dx * dx + dy * dy);
  const float per_length = std::sqrt(per_length2);
  const float ux = dx * per_length;
  const float uy = dy * per_length;
  const float wa = va.value[kWidthPx];
  const float wb = vb.value[kWidthPx];
  // The filter of the middle, times the width where it is: coverage adds up to the width all along.
  const float mean_width = std::max(0.5f * (wa + wb), 1e-4f);
  const law::LineFilter filter = law::line_filter(mean_width, {ux, uy});
  const float per_width = 1.0f / mean_width;
  const Float base = filter.base * per_width;
  const Float slope = filter.slope * per_width;
  const Float peak = filter.peak * per_width;
  const float reach = filter.reach.v[0];
  const float low_x = std::min(ax, bx) - reach;
  const float high_x = std::max(ax, bx) + reach;
  const float low_y = std::min(ay, by) - reach;
  const float high_y = std::max(ay, by) + reach;
  const int y0 = low_y > 0.0f ? static_cast<int>(low_y * (1.0f / kBlockRows)) : 0;
  const int y1 =
      high_y < static_cast<float>(kTile) ? static_cast<int>(high_y * (1.0f / kBlockRows)) : kBlocksDown - 1;
  // Of a steep line the blocks of a row lie close around it.
  constexpr float kSteep = 0.08f;
  const bool is_steep = std::abs(uy) > kSteep;
  const float x_per_y = is_steep ? dx / dy : 0.0f;
  const float room = is_steep ? reach / std::abs(uy) : 0.0f;

  const float along_x = dx * per_length2;
  const float along_y = dy * per_length2;
  const Float cx = block_columns();
  const Float cy = block_rows();
  const float da = vb.value[kOpacity] - va.value[kOpacity];
  const bool fades = da != 0.0f || va.value[kOpacity] != 1.0f;
  const float width_step = wb - wa;
  for (int y = std::max(y0, 0); y <= y1; ++y) {
    float from = low_x;
    float to = high_x;
    const auto top = static_cast<float>(y * kBlockRows);
    if (is_steep) {
      const float x_top = ax + (top - ay) * x_per_y;
      const float x_bottom = x_top + kBlockRows * x_per_y;
      from = std::max(from, std::min(x_top, x_bottom) - room);
      to = std::min(to, std::max(x_top, x_bottom) + room);
    }
    if (!(from < static_cast<float>(kTile))) continue;
    const int x0 = from > 0.0f ? static_cast<int>(from * (1.0f / kBlockColumns)) : 0;
    const int x1 =
        to < static_cast<float>(kTile) ? static_cast<int>(to * (1.0f / kBlockColumns)) : kBlocksAcross - 1;
    const Float py = cy + top;
    for (int x = x0; x <= x1; ++x) {
      const Float px = cx + static_cast<float>(x * kBlockColumns);
      const Float rx = px - ax;
      const Float ry = py - ay;
      const Float across = rx * uy - ry * ux;
      const Float part = simd::clamp(rx * along_x + ry * along_y, 0.0f, 1.0f);
      // shaders/lib/coverage.glsl
      const Float cover =
          simd::min(simd::min(base - slope * simd::abs(across), peak) * (wa + part * width_step), 1.0f);
      // Joints: a pixel belongs to the segment between the mitres of its ends, computed alike on both sides
      // of one.
      const Float behind_a = (px - ax) * va.value[kMitreX] + (py - ay) * va.value[kMitreY];
      const Float behind_b = (px - bx) * vb.value[kMitreX] + (py - by) * vb.value[kMitreY];
      const Bool is_mine = behind_a >= 0.0f && behind_b < 0.0f && cover > 0.0f;
      const int block = y * kBlocksAcross + x;
      Float opacity = fades ? cover * (va.value[kOpacity] + part * da) : cover;
      if (head != nullptr) {
        const Float z = a.z + part * (b.z - a.z);
        opacity = select(z < head->depth[block] + kSkinDepthM, opacity, opacity * head->uncovered[block]);
      }
      const Float share = FloatBits((IntBits)(pixels.passed[block] * opacity).v & is_mine.v);
      pixels.red[block] += share * (va.value[kRed] + part * (vb.value[kRed] - va.value[kRed]));
      pixels.green[block] += share * (va.value[kGreen] + part * (vb.value[kGreen] - va.value[kGreen]));
      pixels.blue[block] += share * (va.value[kBlue] + part * (vb.value[kBlue] - va.value[kBlue]));
      pixels.passed[block] -= share;
    }
  }
}

STRANDCAST_LANES Float tone_mapped(Float linear) {
  // shaders/lib/tone.glsl
  constexpr float kKnee = 0.7f;
  constexpr float kRoom = 1.0f - kKnee;
  const Float over = simd::max(linear - kKnee, 0.0f);
  return simd::min(linear, kKnee) + kRoom * over / (over + kRoom);
}

STRANDCAST_LANES float background_gradient(const TileInput& in, uint32_t row) {
  const float high = 1.0f - (static_cast<float>(row) + 0.5f) / static_cast<float>(in.grid.size_px.y);
  return 1.0f + kGradient * (2.0f * high - 1.0f);
}

STRANDCAST_LANES void fill_background(const TileInput& in, uint32_t left, uint32_t top, uint32_t width,
                                      uint32_t height) {
  for (uint32_t y = 0; y < height; ++y) {
    const glm::vec3 color = in.background * background_gradient(in, top + y);
    uint32_t packed = 0xff000000u;
    for (int c = 0; c < 3; ++c) {
      const auto step = static_cast<int>(std::clamp(color[c], 0.0f, 1.0f) * kSrgbSteps);
      packed |= uint32_t{in.srgb[step]} << (8 * c);
    }
    uint8_t* const row = in.rgba + 4 * (size_t{top + y} * in.grid.size_px.x + left);
    for (uint32_t x = 0; x < width; ++x) std::memcpy(row + 4 * x, &packed, sizeof packed);
  }
}

STRANDCAST_LANES void draw_any_tile_lanes(const TileArguments& arguments) {
  const TileInput& in = *arguments.input;
  TileScratch& scratch = *arguments.scratch;
  const uint32_t tile = arguments.tile;
  const uint32_t begin = in.bins->segments().first[tile];
  const uint32_t count = in.bins->segments().first[tile + 1] - begin;
  const uint32_t left = tile % in.grid.columns() * kTilePx;
  const uint32_t top = tile / in.grid.columns() * kTilePx;

  TileHead head;
  const bool has_head = in.head->mesh != nullptr && draw_head(in, tile, head);
  TilePixels pixels;
  for (int block = 0; block < kBlocks; ++block) {
    pixels.red[block] = pixels.green[block] = pixels.blue[block] = Float(0.0f);
    pixels.passed[block] = Float(1.0f);
  }
  if (count > 0) {
    const uint64_t* const order = sort_segments(in, begin, count, scratch);
    const StrandPoint* const points = in.points->point.data();
    uint32_t until_check = kPairsBetweenChecks;
    for (uint32_t i = 0; i < count; ++i) {
      constexpr uint32_t kAhead = 8;
      const auto next = static_cast<uint32_t>(order[i + kAhead < count ? i + kAhead : count - 1]);
      __builtin_prefetch(points + next);
      __builtin_prefetch(points + next + 1);
      const StrandPoint& a = points[static_cast<uint32_t>(order[i])];
      blend_segment(a, (&a)[1], static_cast<float>(left), static_cast<float>(top), has_head ? &head : nullptr,
                    pixels);
      if (--until_check > 0) continue;
      until_check = kPairsBetweenChecks;
      Float most = pixels.passed[0];
      for (int block = 1; block < kBlocks; ++block) most = simd::max(most, pixels.passed[block]);
      if (!is_any(most > kOpaque)) break;
    }
  }

  const uint32_t width = std::min(kTilePx, in.grid.size_px.x - left);
  const uint32_t height = std::min(kTilePx, in.grid.size_px.y - top);
  if (count == 0 && !has_head) return fill_background(in, left, top, width, height);
  for (int y = 0; y < kBlocksDown; ++y)
    for (int x = 0; x < kBlocksAcross; ++x) {
      const int block = y * kBlocksAcross + x;
      // The two rows of a block have backgrounds of their own.
      const uint32_t row = top + static_cast<uint32_t>(y) * kBlockRows;
      const float upper = background_gradient(in, row);
      const float lower = background_gradient(in, row + 1);
      const Float gradient = FloatBits{upper, upper, upper, upper, lower, lower, lower, lower};
      Float color[3] = {in.background.x * gradient, in.background.y * gradient, in.background.z * gradient};
      {
        Float scene[3] = {pixels.red[block], pixels.green[block], pixels.blue[block]};
        Float drawn = 1.0f - pixels.passed[block];
        if (has_head) {
          const Float seen = pixels.passed[block] * (1.0f - head.uncovered[block]);
          scene[0] += seen * head.red[block];
          scene[1] += seen * head.green[block];
          scene[2] += seen * head.blue[block];
          drawn += seen;
        }
        const Float per_drawn = 1.0f / simd::max(drawn, 1e-5f);
        for (int c = 0; c < 3; ++c) color[c] += drawn * (tone_mapped(scene[c] * per_drawn) - color[c]);
      }
      uint32_t packed[kLanes] = {};
      for (int c = 0; c < 3; ++c) {
        const IntBits step = to_integers(simd::clamp(color[c], 0.0f, 1.0f) * static_cast<float>(kSrgbSteps));
        for (uint32_t lane = 0; lane < kLanes; ++lane)
          packed[lane] |= uint32_t{in.srgb[step[lane]]} << (8 * c);
      }
      for (uint32_t lane = 0; lane < kLanes; ++lane) {
        const uint32_t px = static_cast<uint32_t>(x) * kBlockColumns + lane % kBlockColumns;
        const uint32_t py = static_cast<uint32_t>(y) * kBlockRows + lane / kBlockColumns;
        if (px >= width || py >= height) continue;
        const uint32_t value = packed[lane] | 0xff000000u;
        std::memcpy(in.rgba + 4 * (size_t{top + py} * in.grid.size_px.x + left + px), &value, sizeof value);
      }
    }
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

void place_head(const View& view, WorkerPool& workers, HeadPicture& head) {
  const Mesh& mesh = *head.mesh;
  head.screen.resize(mesh.position_m.size());
  constexpr size_t kVerticesPerRange = 512;
  workers.for_ranges(mesh.position_m.size(), kVerticesPerRange, [&](size_t begin, size_t end) {
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
