#include "common/render/render_scene.h"

#include "common/render/strand_style.h"

namespace strandcast {

LightLatticeDesc describe_lattice(const SceneAsset& asset, const RenderScene& scene, uint32_t cells) {
  return describe_lattice(asset, scene.rest, scene.light_volume, cells);
}

Status check_asset(const SceneAsset& asset) {
  const size_t expected = static_cast<size_t>(asset.strand_count) * asset.vertex_count;
  if (asset.rest_position_m.size() != expected)
    return make_error(ErrorCode::BadInput, "scene asset has {} rest positions for {} strands x {} vertices",
                      asset.rest_position_m.size(), asset.strand_count, asset.vertex_count);
  if (asset.strand_count > 0 &&
      (asset.vertex_count < kMinVertexCount || asset.vertex_count > kMaxVertexCount))
    return make_error(ErrorCode::BadInput, "scene asset has {} vertices per strand, allowed are {} to {}",
                      asset.vertex_count, kMinVertexCount, kMaxVertexCount);
  for (const RootTriangle& triangle : asset.triangle)
    if (glm::any(glm::greaterThanEqual(triangle, glm::uvec3(asset.strand_count))))
      return make_error(ErrorCode::BadInput,
                        "root triangle ({}, {}, {}) names a strand beyond the {} there are", triangle.x,
                        triangle.y, triangle.z, asset.strand_count);
  if (asset.head.normal.size() != asset.head.position_m.size())
    return make_error(ErrorCode::BadInput, "head mesh has {} normals for {} vertices",
                      asset.head.normal.size(), asset.head.position_m.size());
  for (const glm::uvec3& triangle : asset.head.triangle)
    if (glm::any(glm::greaterThanEqual(triangle, glm::uvec3(asset.head.position_m.size()))))
      return make_error(ErrorCode::BadInput,
                        "head triangle ({}, {}, {}) names a vertex beyond the {} there are", triangle.x,
                        triangle.y, triangle.z, asset.head.position_m.size());
  return {};
}

RenderScene::RenderScene(const SceneAsset& asset, const LookDesc& wanted_look, bool is_drawn_by_software)
    : look(drawable(wanted_look)),
      features(analyse_picture(asset, look)),
      is_software(is_drawn_by_software),
      triangle_count(static_cast<uint32_t>(asset.triangle.size())),
      joined_triangle_count(static_cast<uint32_t>(joined_triangles(asset).size())),
      head_vertex_count(static_cast<uint32_t>(asset.head.position_m.size())),
      head_triangle_count(static_cast<uint32_t>(asset.head.triangle.size())),
      rest(measure_rest(asset)),
      light_volume(describe_light(asset, look, rest)),
      key_strands(asset.strand_count, asset.vertex_count) {}

}  // namespace strandcast
