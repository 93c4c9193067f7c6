// Strand pass: a camera-facing quad per expanded segment, shaded per vertex, covered by a fixed pattern
// instead of sorted blending. All calls from the context's thread.
#pragma once

#include <cstdint>

#include "common/base/result.h"
#include "common/gl/objects.h"
#include "common/gl/program.h"
#include "common/render/passes/light_texture.h"
#include "common/render/view.h"
#include "common/scene/scene_desc.h"

namespace strandcast {

class StrandPass {
 public:
  StrandPass() = default;
  static Result<StrandPass> make(const gl::ShaderLibrary& shaders);
  /// Draws the first `segments` segments of an expanded buffer into the bound framebuffer with depth test,
  /// strands `width_m` wide at the root.
  void run(const gl::Buffer& expanded, uint32_t segments, float width_m, const View& view,
           const LookDesc& look, const LightTexture& light) const;

 private:
  gl::Program program_;
  gl::VertexArray vertex_array_;
  gl::Buffer quad_index_;
};

}  // namespace strandcast
