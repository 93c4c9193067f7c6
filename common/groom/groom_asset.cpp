#include "common/groom/groom_asset.h"

#include <utility>

#include "common/base/check.h"

namespace strandcast {

SceneAsset make_scene_asset(const Groom& groom, Mesh head) {
  SceneAsset asset;
  asset.strand_count = groom.strand_count();
  asset.vertex_count = groom.uniform_vertex_count();
  CHECK(asset.strand_count > 0 && asset.vertex_count > 0);
  CHECK(head.normal.size() == head.position_m.size());
  asset.rest_position_m.resize(static_cast<size_t>(asset.strand_count) * asset.vertex_count);
  for (size_t s = 0; s < asset.strand_count; ++s)
    for (size_t v = 0; v < asset.vertex_count; ++v)
      asset.rest_position_m[v * asset.strand_count + s] = groom.rest_position_m[groom.offset[s] + v];
  asset.triangle = make_root_triangles(groom);
  asset.head = std::move(head);
  return asset;
}

}  // namespace strandcast
