// RenderScene: what the passes of every render path share: what the scene is like, and the resources that
// they hand to one another. Made without GL; the passes that write a resource allocate it.
#pragma once

#include <cstdint>

#include "common/gl/pass_plan.h"
#include "common/render/light_lattice.h"
#include "common/render/light_volume.h"
#include "common/render/passes/light_texture.h"
#include "common/render/passes/picture_target.h"
#include "common/render/passes/strand_buffers.h"
#include "common/render/passes/table_textures.h"
#include "common/render/rest_facts.h"
#include "common/scene/features.h"
#include "common/scene/scene_desc.h"
#include "common/scene/shadow_methods.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

class Culling;
class ShadowMap;

/// Numbers of the methods that no scene sets.
struct MethodSettings {
  uint32_t shadow_texels = 512;        // along each side of the light's map
  float strand_opacity = 0.30f;        // optical depth of one strand across, as in the light volume
  uint32_t list_nodes_per_pixel = 12;  // strands over a pixel that there is room for, in the mean
};

struct RenderScene {
  /// The asset has been checked.
  RenderScene(const SceneAsset& asset, const LookDesc& wanted_look, bool is_drawn_by_software);

  /// Whether strands are blended in a layer of their own, over the scene.
  bool has_strand_layer() const {
    return features.has_strands.value &&
           (methods.transparency != TransparencyMethod::Hashed || methods.detail == DetailMethod::Volume);
  }

  LookDesc look;  // within what the renderer can draw
  PictureFeatures features;
  bool is_software = false;            // detail costs more there
  uint32_t triangle_count = 0;         // between roots
  uint32_t joined_triangle_count = 0;  // of them, those whose hair runs together
  uint32_t head_vertex_count = 0;
  uint32_t head_triangle_count = 0;
  RenderMethods methods;  // of the path
  MethodSettings method_settings;
  RestFacts rest;
  LightVolumeDesc light_volume;

  gl::Resource strands{"posed strands"};  // from outside
  KeyStrands key_strands;
  LightTexture light;
  DensityTexture density;
  LobeTables lobe_tables;
  ScatterTables scatter_tables;
  const ShadowMap* shadow = nullptr;  // of the method, where it has one
  Culling* culling = nullptr;         // chooses what the camera draws; none: all
  SceneTarget scene;
  StrandLayer strand_layer;
  PictureTarget picture;
};

/// What the light lattice has to know. `cells`: along the hair's largest side.
LightLatticeDesc describe_lattice(const SceneAsset& asset, const RenderScene& scene, uint32_t cells);

/// BadInput names what of an asset does not fit together.
Status check_asset(const SceneAsset& asset);

}  // namespace strandcast
