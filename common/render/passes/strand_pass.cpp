#include "common/render/passes/strand_pass.h"

#include <epoxy/gl.h>

#include <algorithm>

#include "shaders/shared/bindings.h"

namespace strandcast {
namespace {

constexpr uint32_t kCornersPerSegment = 4;
constexpr uint32_t kIndicesPerSegment = 6;
// Segments per draw such that 16-bit indices reach all corners.
constexpr uint32_t kSegmentsPerDraw = 65'536 / kCornersPerSegment;
constexpr uint32_t kLightUnit = 0;

std::vector<uint16_t> make_quad_indices() {
  std::vector<uint16_t> index;
  index.reserve(kSegmentsPerDraw * kIndicesPerSegment);
  for (uint32_t segment = 0; segment < kSegmentsPerDraw; ++segment)
    for (const uint32_t corner : {0u, 1u, 2u, 2u, 1u, 3u})
      index.push_back(static_cast<uint16_t>(kCornersPerSegment * segment + corner));
  return index;
}

}  // namespace

Result<StrandPass> StrandPass::make(const gl::ShaderLibrary& shaders) {
  StrandPass pass;
  ASSIGN_OR_RETURN(pass.program_,
                   gl::Program::make(shaders, {"render/strand.vert", "render/strand.frag"}, {}));
  pass.vertex_array_ = gl::VertexArray("strand");
  pass.quad_index_ = gl::Buffer::of("quad index", make_quad_indices());
  glVertexArrayElementBuffer(pass.vertex_array_.name(), pass.quad_index_.name());
  return pass;
}

void StrandPass::run(const gl::Buffer& expanded, uint32_t segments, float width_m, const View& view,
                     const LookDesc& look, const LightTexture& light) const {
  program_.use();
  vertex_array_.bind();
  expanded.bind_storage(shader::kBindingExpanded);
  light.set_uniforms(program_, kLightUnit);
  program_.set("u_clip_from_head", view.clip_from_head);
  program_.set("u_eye_m", view.eye_m);
  program_.set("u_target_px", view.target_px);
  program_.set("u_focal_px", view.focal_px);
  program_.set("u_near_m", view.near_m);
  program_.set("u_strand_width_m", width_m);
  program_.set("u_tip_scale", look.tip_scale);
  program_.set("u_root_color", look.root_color);
  program_.set("u_tip_color", look.tip_color);
  for (uint32_t first = 0; first < segments; first += kSegmentsPerDraw) {
    const uint32_t count = std::min(kSegmentsPerDraw, segments - first);
    glDrawElementsBaseVertex(GL_TRIANGLES, static_cast<GLsizei>(count * kIndicesPerSegment),
                             GL_UNSIGNED_SHORT, nullptr, static_cast<GLint>(first * kCornersPerSegment));
  }
}

}  // namespace strandcast
