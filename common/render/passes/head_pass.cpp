#include "common/render/passes/head_pass.h"

#include <epoxy/gl.h>

namespace strandcast {
namespace {

constexpr uint32_t kLightUnit = 0;

void attach(const gl::VertexArray& array, uint32_t slot, const gl::Buffer& values, int components) {
  glVertexArrayVertexBuffer(array.name(), slot, values.name(), 0,
                            components * static_cast<int>(sizeof(float)));
  glVertexArrayAttribFormat(array.name(), slot, components, GL_FLOAT, GL_FALSE, 0);
  glVertexArrayAttribBinding(array.name(), slot, slot);
  glEnableVertexArrayAttrib(array.name(), slot);
}

}  // namespace

Result<HeadPass> HeadPass::make(const gl::ShaderLibrary& shaders, const Mesh& mesh,
                                const std::vector<float>& cover, float shadow_lift_m) {
  HeadPass pass;
  ASSIGN_OR_RETURN(pass.program_, gl::Program::make(shaders, {"render/head.vert", "render/head.frag"}, {}));
  pass.vertex_array_ = gl::VertexArray("head");
  pass.position_ = gl::Buffer::of("head position", mesh.position_m);
  pass.normal_ = gl::Buffer::of("head normal", mesh.normal);
  pass.cover_ = gl::Buffer::of("head cover", cover);
  pass.index_ = gl::Buffer::of("head index", mesh.triangle);
  pass.index_count_ = static_cast<int>(3 * mesh.triangle.size());
  pass.shadow_lift_m_ = shadow_lift_m;
  attach(pass.vertex_array_, 0, pass.position_, 3);
  attach(pass.vertex_array_, 1, pass.normal_, 3);
  attach(pass.vertex_array_, 2, pass.cover_, 1);
  glVertexArrayElementBuffer(pass.vertex_array_.name(), pass.index_.name());
  return pass;
}

void HeadPass::run(const View& view, const LookDesc& look, const LightTexture& light) const {
  program_.use();
  vertex_array_.bind();
  light.set_uniforms(program_, kLightUnit);
  program_.set("u_clip_from_head", view.clip_from_head);
  program_.set("u_eye_m", view.eye_m);
  program_.set("u_skin_color", look.skin_color);
  program_.set("u_root_color", look.root_color);
  program_.set("u_shadow_lift_m", shadow_lift_m_);
  glDrawElements(GL_TRIANGLES, index_count_, GL_UNSIGNED_INT, nullptr);
}

}  // namespace strandcast
