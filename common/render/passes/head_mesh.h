// HeadMesh: the mesh under the hair as it lies on the GPU: positions, normals and how much of the skin is
// under hair, per vertex. All calls from the context's thread.
#pragma once

#include <cstdint>

#include "common/gl/objects.h"
#include "common/groom/bust_skin.h"
#include "common/render/render_scene.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

class HeadMesh {
 public:
  HeadMesh() = default;
  HeadMesh(const SceneAsset& asset, const RenderScene& scene);
  /// Neck and chest are turned so from the next draw() on.
  void pose(const BustTurn& turn);
  /// With the program that is in use, which has the vertex stage render/head.vert.
  void draw() const;
  /// What one of this scene takes.
  static uint64_t size_bytes(const RenderScene& scene);

 private:
  Mesh mesh_;
  BustSkin skin_;
  gl::VertexArray vertex_array_;
  gl::Buffer position_;
  gl::Buffer normal_;
  gl::Buffer cover_;
  gl::Buffer index_;
  int index_count_ = 0;
};

}  // namespace strandcast
