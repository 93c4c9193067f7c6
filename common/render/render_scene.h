// RenderScene: what the passes of every render path share: what the scene is like, and the resources that
// they hand to one another. Made without GL; the passes that write a resource allocate it.
#pragma once

#include <cstdint>

#include "common/gl/pass_plan.h"
#include "common/render/light_volume.h"
#include "common/render/passes/light_texture.h"
#include "common/render/passes/picture_target.h"
#include "common/render/passes/strand_buffers.h"
#include "common/render/passes/table_textures.h"
#include "common/scene/features.h"
#include "common/scene/scene_desc.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

/// Measures of the rest shape.
struct RestFacts {
  float mean_length_m = 0.0f;
  float extent_m = 0.0f;  // largest side of the bounding box
};

struct RenderScene {
  /// The asset has been checked.
  RenderScene(const SceneAsset& asset, const LookDesc& wanted_look, bool is_drawn_by_software);

  LookDesc look;  // within what the renderer can draw
  PictureFeatures features;
  bool is_software = false;     // detail costs more there
  uint32_t triangle_count = 0;  // between roots
  uint32_t head_vertex_count = 0;
  uint32_t head_triangle_count = 0;
  RestFacts rest;
  LightVolumeDesc light_volume;

  gl::Resource strands{"posed strands"};  // from outside
  KeyStrands key_strands;
  LightTexture light;
  DensityTexture density;
  LobeTables lobe_tables;
  ScatterTables scatter_tables;
  SceneTarget scene;
  PictureTarget picture;
};

/// The look within what renderers can draw.
LookDesc drawable(LookDesc look);

/// BadInput names what of an asset does not fit together.
Status check_asset(const SceneAsset& asset);

}  // namespace strandcast
