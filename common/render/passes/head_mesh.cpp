#include "common/render/passes/head_mesh.h"

#include <epoxy/gl.h>

#include "common/render/scalp_cover.h"

namespace strandcast {
namespace {

void attach(const gl::VertexArray& array, uint32_t slot, const gl::Buffer& values, int components) {
  glVertexArrayVertexBuffer(array.name(), slot, values.name(), 0,
                            components * static_cast<int>(sizeof(float)));
  glVertexArrayAttribFormat(array.name(), slot, components, GL_FLOAT, GL_FALSE, 0);
  glVertexArrayAttribBinding(array.name(), slot, slot);
  glEnableVertexArrayAttrib(array.name(), slot);
}

}  // namespace

HeadMesh::HeadMesh(const SceneAsset& asset, const RenderScene& scene)
    : mesh_(asset.head),
      skin_(mesh_),
      vertex_array_("head"),
      position_(gl::Buffer::of("head position", asset.head.position_m)),
      normal_(gl::Buffer::of("head normal", asset.head.normal)),
      cover_(gl::Buffer::of("head cover", scalp_cover(asset, scene.rest.extent_m * kCoverReach))),
      index_(gl::Buffer::of("head index", asset.head.triangle)),
      index_count_(static_cast<int>(3 * asset.head.triangle.size())) {
  attach(vertex_array_, 0, position_, 3);
  attach(vertex_array_, 1, normal_, 3);
  attach(vertex_array_, 2, cover_, 1);
  glVertexArrayElementBuffer(vertex_array_.name(), index_.name());
}

void HeadMesh::pose(const BustTurn& turn) {
  if (!skin_.pose(turn, mesh_)) return;
  position_.write(mesh_.position_m);
  normal_.write(mesh_.normal);
}

void HeadMesh::draw() const {
  vertex_array_.bind();
  glDrawElements(GL_TRIANGLES, index_count_, GL_UNSIGNED_INT, nullptr);
}

uint64_t HeadMesh::size_bytes(const RenderScene& scene) {
  return uint64_t{scene.head_vertex_count} * (2 * sizeof(glm::vec3) + sizeof(float)) +
         uint64_t{scene.head_triangle_count} * sizeof(glm::uvec3);
}

}  // namespace strandcast
