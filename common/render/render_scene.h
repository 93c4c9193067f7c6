// RenderScene: data shared by the passes of every render path: properties of the scene, and the resources
// that passes exchange. Made without GL; the passes that write a resource allocate it.
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

/// Parameters of methods that no scene sets.
struct MethodSettings {
  uint32_t shadow_texels = 512;        // along each side of the light's map
  float strand_opacity = 0.30f;        // optical depth of one strand across, as in the light volume
  uint32_t list_nodes_per_pixel = 12;  // strands over a pixel that there is room for, in the mean
};

struct RenderScene {
  /// Makes the scene of a checked asset (check_asset()).
  RenderScene(const SceneAsset& asset, const LookDesc& wanted_look, bool is_drawn_by_software);

  /// Returns whether strands are drawn to a separate layer and blended over the scene.
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

/// Returns the inputs of the light lattice; `cells` counts along the hair's largest side.
LightLatticeDesc describe_lattice(const SceneAsset& asset, const RenderScene& scene, uint32_t cells);

/// Returns BadInput if parts of an asset are inconsistent, naming them.
Status check_asset(const SceneAsset& asset);

}  // namespace strandcast
