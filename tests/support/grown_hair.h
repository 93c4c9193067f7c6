// Hair on a ball, and pictures of it drawn in tiles.
#pragma once

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "common/groom/groom_asset.h"
#include "common/groom/mesh.h"
#include "common/groom/procedural.h"
#include "common/render/tiles/tile_renderer.h"
#include "tests/support/own_workers.h"

namespace strandcast {

inline constexpr float kHeadRadiusM = 0.095f;

inline SceneAsset grown_hair(uint32_t strands = 300, uint32_t vertices = 12) {
  ProceduralGroomOptions options;
  options.strand_count = strands;
  options.vertex_count = vertices;
  options.length_m = 0.2f;
  auto groom = grow_groom(make_scalp_cap(glm::vec3(0.0f), kHeadRadiusM, 1000), options);
  EXPECT_TRUE(groom);
  return make_scene_asset(*groom, make_head(kHeadRadiusM));
}

/// The head of an asset without its hair.
inline SceneAsset bald(SceneAsset asset) {
  asset.strand_count = asset.vertex_count = 0;
  asset.rest_position_m.clear();
  asset.triangle.clear();
  return asset;
}

/// Hair that cannot be, each some key strands on a head: places that are no number, too far or all one, and
/// no triangles.
inline std::vector<SceneAsset> impossible_hair() {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInf = std::numeric_limits<float>::infinity();
  std::vector<SceneAsset> all;
  for (const glm::vec3 place_m : {glm::vec3(kNan), glm::vec3(kInf, 0.0f, -kInf), glm::vec3(1e30f)}) {
    all.push_back(grown_hair(40));
    all.back().rest_position_m[45] = place_m;
  }
  for (const float place_m : {kNan, 0.1f}) {
    all.push_back(grown_hair(40));
    all.back().rest_position_m.assign(all.back().rest_position_m.size(), glm::vec3(place_m));
  }
  all.push_back(grown_hair(40));
  all.back().triangle.clear();
  return all;
}

inline Image drawn(const SceneAsset& asset, const LookDesc& look,
                   const TileOptions& options = {own_workers(1), simd::widest_set()},
                   RenderSize size = {160, 120}, const CameraDesc& camera = {},
                   DebugView debug_view = DebugView::None) {
  auto renderer = make_tile_renderer(asset, look, options);
  if (!renderer) {
    ADD_FAILURE() << renderer.error().to_string();
    return {};
  }
  PosedStrands strands{{}, asset.rest_position_m};
  strands.world_from_head.rotation = glm::angleAxis(0.3, glm::dvec3(0.0, 1.0, 0.0));
  const Status status = (*renderer)->draw(strands, camera, size, {1.0f, {}, debug_view});
  EXPECT_TRUE(status) << status.error().to_string();
  return (*renderer)->read_image();
}

}  // namespace strandcast
