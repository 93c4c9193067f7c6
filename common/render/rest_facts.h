// Measures of an asset at rest that renderers take once, and descriptions of the light volumes derived from
// them. Pure functions; no GL.
#pragma once

#include <cstdint>

#include "common/render/light_lattice.h"
#include "common/render/light_volume.h"
#include "common/scene/scene_desc.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

/// Measures of the rest shape.
struct RestFacts {
  float mean_length_m = 0.0f;
  float extent_m = 0.0f;     // largest side of the bounding box
  float mean_bend_m = 0.0f;  // of a strand's curve between two vertices: its second derivative
};

RestFacts measure_rest(const SceneAsset& asset);

/// Returns the look with its values limited to what renderers can draw.
LookDesc drawable(LookDesc look);

/// Returns the inputs of the light volume.
LightVolumeDesc describe_light(const SceneAsset& asset, const LookDesc& look, const RestFacts& rest);
/// Returns the inputs of the light lattice; `cells` counts along the hair's largest side.
LightLatticeDesc describe_lattice(const SceneAsset& asset, const RestFacts& rest,
                                  const LightVolumeDesc& light_volume, uint32_t cells);

}  // namespace strandcast
