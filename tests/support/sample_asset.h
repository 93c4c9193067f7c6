// A small scene asset with random but valid content, for codec tests.
#pragma once

#include <random>

#include "common/groom/groom.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

inline Groom random_groom(uint32_t strand_count, uint32_t vertex_count, uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> along(-0.3f, 0.3f);
  Groom groom;
  groom.name = "random";
  groom.offset.push_back(0);
  for (uint32_t s = 0; s < strand_count; ++s) {
    for (uint32_t v = 0; v < vertex_count; ++v)
      groom.rest_position_m.push_back({along(random), along(random), along(random)});
    groom.offset.push_back(static_cast<uint32_t>(groom.rest_position_m.size()));
  }
  groom.pinned.assign(groom.rest_position_m.size(), 0);
  return groom;
}

inline Mesh sample_mesh() {
  Mesh mesh;
  mesh.position_m = {{0.0f, 0.1f, 0.0f}, {0.1f, 0.0f, 0.0f}, {0.0f, 0.0f, 0.1f}, {-0.1f, 0.0f, 0.0f}};
  mesh.normal = {{0.0f, 1.0f, 0.0f}, {1.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 1.0f}, {-1.0f, 0.0f, 0.0f}};
  mesh.triangle = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}};
  return mesh;
}

inline SceneAsset sample_asset(uint32_t strand_count, uint32_t vertex_count) {
  SceneAsset asset;
  asset.strand_count = strand_count;
  asset.vertex_count = vertex_count;
  asset.rest_position_m = random_groom(strand_count, vertex_count, 1).rest_position_m;
  for (uint32_t s = 0; s + 2 < strand_count; ++s) asset.triangle.push_back({s, s + 1, s + 2});
  asset.head = sample_mesh();
  return asset;
}

}  // namespace strandcast
