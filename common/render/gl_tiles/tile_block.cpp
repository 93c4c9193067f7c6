#include "common/render/gl_tiles/tile_block.h"

#include <algorithm>

#include "shaders/shared/tiles.h"

namespace strandcast {

glm::uvec2 gpu_tiles(glm::uvec2 size_px) {
  const glm::uvec2 tile(shader::kTileColumns, shader::kTileRows);
  return (size_px + tile - 1u) / tile;
}

TileBlock make_tile_block(const TileBlockInput& in) {
  const ShadingNumbers look = shading_numbers(in.look);
  const StyleNumbers style = style_numbers(in.look, in.facts.mean_length_m);
  const float width_m = drawn_width_m(in.facts, in.look, std::max(in.detail.strand_count, 1u));
  const glm::uvec2 tiles = gpu_tiles(glm::uvec2(in.view.target_px));
  TileBlock block;
  block.clip_from_head = in.view.clip_from_head;
  block.head_from_clip = glm::mat4(glm::inverse(glm::dmat4(in.view.clip_from_head)));
  block.eye = glm::vec4(in.view.eye_m, in.view.near_m);
  block.target = glm::vec4(in.view.target_px, in.view.focal_px, in.view.far_m);
  block.strand = glm::vec4(width_m, in.look.tip_scale, in.look.style.tip_fade, 0.0f);
  block.root_color = glm::vec4(look.root_color, look.ambient);
  block.tip_color = glm::vec4(look.tip_color, 0.0f);
  // schema begin: fill block
  // clang-format off
  block.shading[0].x = look.diffuse;
  block.shading[0].y = look.scatter;
  block.shading[0].z = look.highlight;
  block.shading[0].w = look.transmission;
  block.shading[1].x = look.second_highlight;
  block.shading[1].y = look.width_rad;
  block.shading[1].z = look.tilt_rad;
  block.shading[1].w = look.tilt_spread_rad;
  block.shading[2].x = look.root_darkening;
  block.shading[2].y = look.strand_variation;
  block.shading[2].z = look.lock_variation;
  block.shading[2].w = look.warmth_variation;
  block.shading[3].x = look.wetness;
  // clang-format on
  // schema end
  block.to_key = glm::vec4(in.lights.to_key, in.lights.has_rim ? 1.0f : 0.0f);
  block.key_color = glm::vec4(look.key_color, 0.0f);
  block.to_rim = glm::vec4(in.lights.to_rim, 0.0f);
  block.rim_color = glm::vec4(look.rim_color, 0.0f);
  block.up = glm::vec4(in.lights.up, in.shadow_lift_m);
  block.skin_color = glm::vec4(look.skin_color, 0.0f);
  block.background = glm::vec4(in.look.background, 0.0f);
  block.style[0] = {style.clump, style.locks, style.spread_m, style.wave_m};
  block.style[1] = {style.wave_count, style.frizz_m, style.frizz_count, style.stray_share};
  block.style[2] = {style.stray_spread, style.length_spread, style.short_share, 0.0f};
  for (int axis = 0; axis < 3; ++axis) block.lattice_axis[axis] = glm::vec4(in.lattice.axis[axis], 0.0f);
  block.lattice_origin = glm::vec4(in.lattice.origin_m, in.lattice.cell_m);
  block.lattice_size = glm::ivec4(in.lattice.size, 0);
  block.half_size = glm::ivec4(in.lattice.half_size, 0);
  block.strands = {in.detail.strand_count, in.facts.key_count, in.facts.vertex_count,
                   in.detail.segments_per_gap};
  block.followers = {std::max(in.detail.followers, 1u), std::max(in.look.followers, 1u),
                     points_per_strand(in.facts, in.detail), 0};
  block.grid = {tiles, in.detail.strand_count, 0};
  return block;
}

}  // namespace strandcast
