#include "client/web/strand_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "client/web/core_export.h"
#include "common/base/worker_pool.h"
#include "common/groom/bust_skin.h"
#include "common/render/gl_tiles/tile_block.h"
#include "common/render/rest_facts.h"
#include "common/render/scalp_cover.h"
#include "common/render/tiles/strand_expansion.h"
#include "common/render/tiles/strand_shading.h"
#include "common/render/tiles/tile_bins.h"
#include "common/render/tiles/tile_raster.h"
#include "common/render/view.h"
#include "common/strands/head/head_mesh.h"

using namespace strandcast;

namespace {

// Points of all drawn strands at most: fewer strands are drawn instead of more.
constexpr uint64_t kMaxPoints = uint64_t{2} << 20;

uint32_t offset_of(const void* data) {
  return static_cast<uint32_t>(reinterpret_cast<uintptr_t>(data));
}

/// Stored depths as IEEE halves, in units of optical depth.
std::vector<uint16_t> make_half_depths() {
  std::vector<uint16_t> halves(65536);
  for (uint32_t stored = 1; stored < halves.size(); ++stored) {
    const float depth = static_cast<float>(stored) * kLightDepthUnit;  // 2^-10 .. 64: normal as a half
    uint32_t bits;
    std::memcpy(&bits, &depth, sizeof bits);
    halves[stored] = static_cast<uint16_t>((bits + 0x1000u - (112u << 23)) >> 13);
  }
  return halves;
}

uint32_t count(float value, uint32_t least, uint32_t most) {
  if (!(value > static_cast<float>(least))) return least;
  return value < static_cast<float>(most) ? static_cast<uint32_t>(value) : most;
}

// schema begin: look block reader
// clang-format off
/// Sets the numbers of a look. Counts that are no numbers within their limits become the nearest limit.
void set_numbers(LookDesc& look, const StrandPictureLook& n) {
  look.root_color = {n.root_color[0], n.root_color[1], n.root_color[2]};
  look.tip_color = {n.tip_color[0], n.tip_color[1], n.tip_color[2]};
  look.strand_radius_m = n.strand_radius_m;
  look.tip_scale = n.tip_scale;
  look.followers = count(n.followers, 0, 64);
  look.segments = count(n.segments, 1, 8);
  look.light_direction = {n.light_direction[0], n.light_direction[1], n.light_direction[2]};
  look.light_color = {n.light_color[0], n.light_color[1], n.light_color[2]};
  look.ambient = n.ambient;
  look.background = {n.background[0], n.background[1], n.background[2]};
  look.skin_color = {n.skin_color[0], n.skin_color[1], n.skin_color[2]};
  look.eumelanin = n.eumelanin;
  look.pheomelanin = n.pheomelanin;
  look.rim_direction = {n.rim_direction[0], n.rim_direction[1], n.rim_direction[2]};
  look.rim_color = {n.rim_color[0], n.rim_color[1], n.rim_color[2]};
  look.exposure = n.exposure;
  look.style.clump = n.style_clump;
  look.style.locks = count(n.style_locks, 1, 16);
  look.style.spread = n.style_spread;
  look.style.wave_m = n.style_wave_m;
  look.style.wave_count = n.style_wave_count;
  look.style.frizz_m = n.style_frizz_m;
  look.style.frizz_count = n.style_frizz_count;
  look.style.stray_share = n.style_stray_share;
  look.style.stray_spread = n.style_stray_spread;
  look.style.length_spread = n.style_length_spread;
  look.style.short_share = n.style_short_share;
  look.style.tip_fade = n.style_tip_fade;
  look.shading.diffuse = n.shading_diffuse;
  look.shading.scatter = n.shading_scatter;
  look.shading.highlight = n.shading_highlight;
  look.shading.transmission = n.shading_transmission;
  look.shading.second_highlight = n.shading_second_highlight;
  look.shading.highlight_width_deg = n.shading_highlight_width_deg;
  look.shading.cuticle_deg = n.shading_cuticle_deg;
  look.shading.cuticle_spread_deg = n.shading_cuticle_spread_deg;
  look.shading.root_darkening = n.shading_root_darkening;
  look.shading.strand_variation = n.shading_strand_variation;
  look.shading.lock_variation = n.shading_lock_variation;
  look.shading.warmth_variation = n.shading_warmth_variation;
  look.shading.wetness = n.shading_wetness;
}
// clang-format on
// schema end

LookDesc look_of(const StrandPictureLook& numbers, std::string hair_color) {
  LookDesc look;
  look.hair_color = std::move(hair_color);
  set_numbers(look, numbers);
  return drawable(std::move(look));
}

}  // namespace

struct StrandPicture {
  explicit StrandPicture(SceneAsset from)
      : asset(std::move(from)),
        rest(measure_rest(asset)),
        position_m(asset.rest_position_m),
        expansion(asset, rest.mean_length_m),
        lattice(describe_lattice(asset, rest, describe_light(asset, look, rest), kLightCells)),
        skin(asset.head),
        cover(scalp_cover(asset, rest.extent_m * kCoverReach)),
        half_depth(make_half_depths()),
        srgb(make_srgb_table()) {
    facts.key_count = asset.strand_count;
    facts.vertex_count = asset.vertex_count;
    facts.triangle_count = static_cast<uint32_t>(asset.triangle.size());
    facts.mean_length_m = rest.mean_length_m;
    facts.mean_bend_m = rest.mean_bend_m;
    facts.max_points = kMaxPoints;
    expansion.set_look(look);
    const Mesh& mesh = asset.head;
    head = {static_cast<uint32_t>(mesh.position_m.size()),
            static_cast<uint32_t>(mesh.triangle.size()),
            offset_of(mesh.position_m.data()),
            offset_of(mesh.normal.data()),
            offset_of(cover.data()),
            offset_of(mesh.triangle.data())};
    if (mesh.triangle.empty()) return;
    drawn_head.mesh = &mesh;
    drawn_head.cover = &cover;
  }

  SceneAsset asset;
  RestFacts rest;
  LookDesc look;
  DetailFacts facts;
  WorkerPool workers{1};
  std::vector<glm::vec3> position_m;
  StrandExpansion expansion;
  StrandPoints points;
  LightLattice lattice;
  BustSkin skin;
  std::vector<float> cover;
  StrandPictureHead head{};
  StrandPictureParts parts{};
  TileBlock block{};

  // Of what `points` and `lattice` were made.
  uint64_t state_number = 1, expanded_state = 0;
  StrandDetail detail;
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};
  LightDirections lights;
  float width_m = 0.0f;

  // For a graphics card.
  std::vector<uint16_t> half_depth, key_depth, other_depth;
  std::vector<float> place_m;
  std::vector<uint32_t> strand, strand_of;
  std::vector<float> away_m;
  std::vector<uint64_t> order, sorted;
  std::vector<uint32_t> corner;
  uint64_t placed_state = 0;

  // For a picture made here.
  HeadPicture drawn_head;
  TileBins bins;
  TileScratch scratch;
  std::vector<uint8_t> srgb, rgba;
  ShadeInput shade{};
  TileGrid grid;
};

namespace {

constexpr simd::InstructionSet kSet = simd::InstructionSet::Plain;

struct Turn {
  View view;
  glm::dquat rotation;
  BustTurn bust{0.0};
};

Result<Turn> turn_of(const StrandPictureView& wish) {
  CameraDesc camera;
  camera.offset_m = {wish.offset_m[0], wish.offset_m[1], wish.offset_m[2]};
  camera.target_m = {wish.target_m[0], wish.target_m[1], wish.target_m[2]};
  camera.fov_y_rad = wish.fov_y_rad;
  const float* const r = wish.head_rotation;
  Turn turn;
  turn.rotation = glm::dquat(static_cast<double>(r[0]), static_cast<double>(r[1]), static_cast<double>(r[2]),
                             static_cast<double>(r[3]));
  turn.bust = BustTurn(wish.bust[0], wish.bust[1], wish.bust[2]);
  const glm::uvec2 size(static_cast<uint32_t>(std::clamp(wish.width_px, 1.0f, 8192.0f)),
                        static_cast<uint32_t>(std::clamp(wish.height_px, 1.0f, 8192.0f)));
  ASSIGN_OR_RETURN(turn.view, make_view(camera, turn.rotation, size));
  return turn;
}

bool is_same(const StrandDetail& a, const StrandDetail& b) {
  return a.segments_per_gap == b.segments_per_gap && a.followers == b.followers &&
         a.strand_count == b.strand_count;
}

/// Strands on their curves, and their light: anew only where something changed.
void expand_and_light(StrandPicture& p, const Turn& turn, float strand_share, bool is_drawn_here) {
  DrawTerms terms;
  terms.strand_share = strand_share;
  const StrandDetail detail = choose_detail(p.facts, p.look, turn.view, terms);
  // Who draws here moves points onto the screen, in place.
  const bool is_expanded = p.expanded_state == p.state_number && is_same(detail, p.detail) && !is_drawn_here;
  if (is_expanded && turn.rotation == p.rotation) return;
  p.detail = detail;
  p.rotation = turn.rotation;
  p.expansion.expand(p.position_m, detail, p.workers, kSet, p.points);
  p.expanded_state = p.state_number;
  ++p.parts.light_number;
  p.width_m = drawn_width_m(p.facts, p.look, std::max(p.points.strand_count(), 1u));
  p.lights = light_directions(p.look, turn.rotation, turn.view.up);
  const LatticeFrame frame = fit_lattice(p.lattice.desc(), p.lights, p.position_m,
                                         style_room_m(style_numbers(p.look, p.facts.mean_length_m)));
  if (p.skin.pose(turn.bust, p.asset.head)) ++p.parts.head_number;
  p.lattice.set_bust(turn.bust);
  p.lattice.build(frame, p.points, {p.width_m, p.look.tip_scale, p.look.style.tip_fade}, p.lights, p.workers);
}

/// Depths, points and strands as a graphics card takes them.
void place_for_card(StrandPicture& p) {
  if (p.placed_state == p.parts.light_number) return;
  p.placed_state = p.parts.light_number;
  const LightLatticeView& view = p.lattice.view();
  const auto cells = [](const glm::ivec3& size) { return static_cast<size_t>(size.x) * size.y * size.z; };
  p.key_depth.resize(cells(view.size));
  for (size_t i = 0; i < p.key_depth.size(); ++i) p.key_depth[i] = p.half_depth[view.key[i]];
  const size_t halves = cells(view.half_size);
  p.other_depth.resize(2 * halves);
  for (size_t i = 0; i < halves; ++i) {
    p.other_depth[i] = p.half_depth[view.others[i] & 0xffffu];
    p.other_depth[halves + i] = p.half_depth[view.others[i] >> 16];
  }
  const size_t count = p.points.point.size();
  p.place_m.assign(3 * (count + 2), 0.0f);
  for (size_t i = 0; i < count; ++i)
    std::memcpy(&p.place_m[3 * (i + 1)], &p.points.point[i], 3 * sizeof(float));
  std::vector<uint32_t> strand;
  strand.reserve(size_t{4} * p.points.strand_count());
  for (uint32_t s = 0; s < p.points.strand_count(); ++s) {
    const uint32_t first = p.points.first_point[s];
    for (const uint32_t n : {first, p.points.first_point[s + 1] - first, p.points.index[s], p.points.lock[s]})
      strand.push_back(n);
  }
  if (strand == p.strand) return;
  p.strand = std::move(strand);
  p.strand_of.resize(count);
  for (uint32_t s = 0; s < p.points.strand_count(); ++s)
    std::fill(p.strand_of.begin() + p.points.first_point[s],
              p.strand_of.begin() + p.points.first_point[s + 1], s);
  ++p.parts.layout_number;
}

/// Segments by the depths of their middles, from back to front.
void order_segments(StrandPicture& p, const View& view) {
  const size_t count = p.points.point.size();
  const glm::mat4& m = view.clip_from_head;
  const glm::vec4 away(m[0].w, m[1].w, m[2].w, m[3].w);
  p.away_m.resize(count);
  float low = 1e30f;
  float high = -1e30f;
  for (size_t i = 0; i < count; ++i) {
    const float* const at = &p.place_m[3 * (i + 1)];
    const float z = away.x * at[0] + away.y * at[1] + away.z * at[2] + away.w;
    p.away_m[i] = z;
    low = std::min(low, z);
    high = std::max(high, z);
  }
  constexpr float kSteps = 65535.0f;
  const float scale = kSteps / std::max(2.0f * (high - low), 1e-9f);
  p.order.clear();
  p.order.reserve(count);
  std::array<std::array<uint32_t, 256>, 2> counts{};
  for (uint32_t s = 0; s < p.points.strand_count(); ++s)
    for (uint32_t i = p.points.first_point[s]; i + 1 < p.points.first_point[s + 1]; ++i) {
      const float nearest = std::min(p.away_m[i], p.away_m[i + 1]);
      if (!(nearest > view.near_m)) continue;
      const float step = std::clamp((p.away_m[i] + p.away_m[i + 1] - 2.0f * low) * scale, 0.0f, kSteps);
      const auto key = 65535u - static_cast<uint32_t>(step);
      p.order.push_back(uint64_t{key} << 32 | i);
      ++counts[0][key & 255];
      ++counts[1][key >> 8];
    }
  p.sorted.resize(p.order.size());
  for (uint32_t pass = 0; pass < 2; ++pass) {
    uint32_t sum = 0;
    for (uint32_t& entry : counts[pass]) sum += std::exchange(entry, sum);
    for (const uint64_t one : p.order) p.sorted[counts[pass][one >> (32 + 8 * pass) & 255]++] = one;
    std::swap(p.order, p.sorted);
  }
  // Each point has two corners, each segment two triangles between four of them.
  p.corner.resize(6 * p.order.size());
  uint32_t* out = p.corner.data();
  for (const uint64_t one : p.order) {
    const uint32_t first = 2 * static_cast<uint32_t>(one);
    for (const uint32_t corner : {0u, 1u, 2u, 2u, 1u, 3u}) *out++ = first + corner;
  }
}

void begin_here(StrandPicture& p, const Turn& turn) {
  p.grid = {glm::uvec2(turn.view.target_px)};
  p.lattice.hide_from(turn.view.eye_m);
  p.shade = {
      shading_numbers(p.look), p.lights,       p.lattice.view(), turn.view, p.width_m, p.look.tip_scale,
      p.look.style.tip_fade,   DebugView::None};
  shade_points(p.shade, p.workers, kSet, p.points);
  p.expanded_state = 0;
  p.bins.bin_segments(p.points, p.grid, turn.view.near_m, p.workers);
  if (p.drawn_head.mesh != nullptr) {
    p.drawn_head.shadow_lift_m = kSkinLift * p.lattice.view().soft_m;
    place_head(turn.view, p.workers, p.drawn_head);
  }
  p.bins.bin_boxes(p.drawn_head.box, p.grid);
  p.rgba.resize(size_t{4} * p.grid.size_px.x * p.grid.size_px.y);
}

void draw_tiles(StrandPicture& p, uint32_t begin, uint32_t end) {
  const TileInput input{&p.points, &p.bins,           &p.drawn_head, &p.shade,
                        p.grid,    p.look.background, p.srgb.data(), p.rgba.data()};
  for (uint32_t tile = begin; tile < std::min(end, p.grid.count()); ++tile)
    draw_tile(kSet, {&input, &p.scratch, tile});
}

}  // namespace

STRAND_CORE_EXPORT void strand_picture_expect_asset() {
  make_head(1.0f);
}
STRAND_CORE_EXPORT StrandPicture* strand_picture_make(const std::byte* payload, size_t size_bytes) {
  auto asset = decode_scene_asset({payload, size_bytes});
  if (!asset) {
    remember_core_error(asset.error());
    return nullptr;
  }
  return std::make_unique<StrandPicture>(std::move(asset).value()).release();
}
STRAND_CORE_EXPORT void strand_picture_delete(StrandPicture* picture) {
  delete picture;
}
STRAND_CORE_EXPORT const StrandPictureHead* strand_picture_head(const StrandPicture* picture) {
  return &picture->head;
}

STRAND_CORE_EXPORT void strand_picture_set_look(StrandPicture* picture, const StrandPictureLook* look,
                                                const char* hair_color, size_t hair_color_bytes) {
  picture->look = look_of(*look, std::string(hair_color, hair_color_bytes));
  picture->expansion.set_look(picture->look);
  ++picture->state_number;
}
STRAND_CORE_EXPORT float* strand_picture_positions(StrandPicture* picture) {
  return picture->position_m.empty() ? nullptr : &picture->position_m.front().x;
}
STRAND_CORE_EXPORT void strand_picture_changed(StrandPicture* picture) {
  ++picture->state_number;
}

STRAND_CORE_EXPORT const StrandPictureParts* strand_picture_prepare(StrandPicture* picture,
                                                                    const StrandPictureView* view) {
  StrandPicture& p = *picture;
  const auto turn = turn_of(*view);
  if (!turn) {
    remember_core_error(turn.error());
    return nullptr;
  }
  expand_and_light(p, *turn, view->strand_share, false);
  place_for_card(p);
  order_segments(p, turn->view);
  const LightLatticeView& lattice = p.lattice.view();
  p.block =
      make_tile_block({p.look, turn->view, p.facts, p.detail, p.lights, lattice, kSkinLift * lattice.soft_m});
  StrandPictureParts& parts = p.parts;
  parts.block = offset_of(&p.block);
  parts.block_bytes = sizeof p.block;
  parts.point_count = static_cast<uint32_t>(p.points.point.size());
  parts.points = offset_of(p.place_m.data());
  parts.strands = offset_of(p.strand.data());
  parts.strand_count = p.points.strand_count();
  parts.strand_of = offset_of(p.strand_of.data());
  parts.corner_count = static_cast<uint32_t>(p.corner.size());
  parts.corners = offset_of(p.corner.data());
  parts.key_depth = offset_of(p.key_depth.data());
  parts.other_depth = offset_of(p.other_depth.data());
  for (int axis = 0; axis < 3; ++axis) {
    parts.lattice_size[axis] = static_cast<uint32_t>(lattice.size[axis]);
    parts.half_size[axis] = static_cast<uint32_t>(lattice.half_size[axis]);
  }
  return &parts;
}

STRAND_CORE_EXPORT const StrandPictureParts* strand_picture_begin(StrandPicture* picture,
                                                                  const StrandPictureView* view) {
  StrandPicture& p = *picture;
  const auto turn = turn_of(*view);
  if (!turn) {
    remember_core_error(turn.error());
    return nullptr;
  }
  expand_and_light(p, *turn, view->strand_share, true);
  begin_here(p, *turn);
  p.parts.rgba = offset_of(p.rgba.data());
  p.parts.tile_count = p.grid.count();
  return &p.parts;
}
STRAND_CORE_EXPORT void strand_picture_draw_tiles(StrandPicture* picture, uint32_t begin, uint32_t end) {
  draw_tiles(*picture, begin, end);
}
