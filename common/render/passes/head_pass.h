// Head pass: the mesh under the hair, with skin that is lit and shadowed by the light volume. All calls from
// the context's thread.
#pragma once

#include <vector>

#include "common/base/result.h"
#include "common/gl/objects.h"
#include "common/gl/program.h"
#include "common/groom/mesh.h"
#include "common/render/passes/light_texture.h"
#include "common/render/view.h"
#include "common/scene/scene_desc.h"

namespace strandcast {

class HeadPass {
 public:
  HeadPass() = default;
  /// The mesh must have triangles. `cover`: per vertex, 0 bare skin .. 1 under hair; `shadow_lift_m` is how
  /// far above the skin the hair's shadow is looked up.
  static Result<HeadPass> make(const gl::ShaderLibrary& shaders, const Mesh& mesh,
                               const std::vector<float>& cover, float shadow_lift_m);
  /// Draws into the bound framebuffer with depth test.
  void run(const View& view, const LookDesc& look, const LightTexture& light) const;

 private:
  gl::Program program_;
  gl::VertexArray vertex_array_;
  gl::Buffer position_;
  gl::Buffer normal_;
  gl::Buffer cover_;
  gl::Buffer index_;
  int index_count_ = 0;
  float shadow_lift_m_ = 0.0f;
};

}  // namespace strandcast
