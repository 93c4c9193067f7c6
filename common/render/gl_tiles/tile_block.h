// TileBlock: the uniform block that all kernels of the tiles on the GPU read, as
// shaders/render/tile_frame.glsl declares it. Filled once per picture; no GL.
#pragma once

#include <glm/glm.hpp>
#include <type_traits>

#include "common/render/light_lattice.h"
#include "common/render/look_lights.h"
#include "common/render/strand_detail.h"
#include "common/render/strand_style.h"
#include "common/render/view.h"

namespace strandcast {

/// std140: nothing but four-vectors and matrices of them. shaders/render/tile_frame.glsl says what each
/// holds.
struct TileBlock {
  glm::mat4 clip_from_head;
  glm::mat4 head_from_clip;
  glm::vec4 eye;
  glm::vec4 target;
  glm::vec4 strand;
  glm::vec4 root_color;
  glm::vec4 tip_color;
  glm::vec4 lobes;
  glm::vec4 scales;
  glm::vec4 variation;
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
static_assert(sizeof(TileBlock) == (8 + 15 + 3 + 3 + 3 + 3) * 16 && std::is_trivially_copyable_v<TileBlock>);

/// What of a scene and a look goes into it, beside the picture's own.
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

/// Tiles across and down a picture.
glm::uvec2 gpu_tiles(glm::uvec2 size_px);

}  // namespace strandcast
