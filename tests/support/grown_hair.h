// Hair that is grown on a head of spheres and ellipsoids, for tests of renderers.
#pragma once

#include <gtest/gtest.h>

#include "common/groom/groom_asset.h"
#include "common/groom/mesh.h"
#include "common/groom/procedural.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

/// Key strands of 12 vertices and 0.2 m on a head of 0.095 m.
inline SceneAsset grown_hair(uint32_t strands = 300) {
  constexpr float kHeadRadiusM = 0.095f;
  ProceduralGroomOptions options;
  options.strand_count = strands;
  options.vertex_count = 12;
  options.length_m = 0.2f;
  auto groom = grow_groom(make_scalp_cap(glm::vec3(0.0f), kHeadRadiusM, 1000), options);

  EXPECT_TRUE(groom);
  return make_scene_asset(*groom, make_head(kHeadRadiusM));
}

}  // namespace strandcast
