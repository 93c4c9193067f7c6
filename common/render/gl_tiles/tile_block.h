// TileBlock: the uniform block of all GPU kernels of the tiles, declared in shaders/render/tile_frame.glsl.
// Filled once per picture; no GL.
#pragma once

#include <glm/glm.hpp>
#include <type_traits>

#include "common/render/light_lattice.h"
#include "common/render/look_lights.h"
#include "common/render/strand_detail.h"
#include "common/render/strand_style.h"
#include "common/render/view.h"

namespace strandcast {

/// Block in std140 layout, so it holds only four-component vectors and matrices.
/// shaders/render/tile_frame.glsl describes each member.
struct TileBlock {
  glm::mat4 clip_from_head;
  glm::mat4 head_from_clip;
  glm::vec4 eye;
  glm::vec4 target;
  glm::vec4 strand;
  glm::vec4 root_color;
  glm::vec4 tip_color;
  // schema begin: shading block
  // clang-format off
  glm::vec4 shading[4];
  // clang-format on
  // schema end
  glm::vec4 to_key;
  glm::vec4 key_color;
  glm::vec4 to_rim;
  glm::vec4 rim_color;
  glm::vec4 up;
  glm::vec4 skin_color;
  glm::vec4 background;
  glm::vec4 style[3];
  glm::vec4 lattice_axis[3];
  glm::vec4 lattice_origin;
  glm::ivec4 lattice_size;
  glm::ivec4 half_size;
  glm::uvec4 strands;
  glm::uvec4 followers;
  glm::uvec4 grid;
};
static_assert(std::is_trivially_copyable_v<TileBlock> && sizeof(TileBlock) % 16 == 0);

/// Values of scene and look that the block needs besides those of the picture.
struct TileBlockInput {
  const LookDesc& look;
  const View& view;  // target_px: of the picture
  const DetailFacts& facts;
  const StrandDetail& detail;
  const LightDirections& lights;
  const LatticeFrame& lattice;
  float shadow_lift_m;  // how far above the skin the hair's shadow is looked up
};
TileBlock make_tile_block(const TileBlockInput& input);

/// Returns the number of tiles across and down a picture.
glm::uvec2 gpu_tiles(glm::uvec2 size_px);

}  // namespace strandcast
