// HeadMesh: the mesh under the hair on the GPU: positions, normals, and per vertex how far the skin is
// covered by hair. All calls from the context's thread.
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
  /// Sets the rotation of neck and chest from the next draw() on.
  void pose(const BustTurn& turn);
  /// Draws with the active program, whose vertex stage must be render/head.vert.
  void draw() const;
  /// Returns the bytes of this scene's head mesh.
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
