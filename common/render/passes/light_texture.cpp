#include "common/render/passes/light_texture.h"

#include <epoxy/gl.h>

namespace strandcast {

void LightTexture::upload(const LightVolume& volume) {
  if (size_ != volume.size()) {
    size_ = volume.size();
    GLuint name = 0;
    glCreateTextures(GL_TEXTURE_3D, 1, &name);
    texture_ = gl::Handle<gl::delete_texture>(name);
    glTextureStorage3D(name, 1, GL_RG16, size_.x, size_.y, size_.z);
    glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTextureParameteri(name, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    for (const GLenum axis : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R})
      glTextureParameteri(name, axis, GL_CLAMP_TO_EDGE);
  }
  origin_m_ = volume.origin_m();
  volume_from_m_ = 1.0f / (volume.cell_m() * glm::vec3(size_));
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  glTextureSubImage3D(texture_.name(), 0, 0, 0, 0, size_.x, size_.y, size_.z, GL_RG, GL_UNSIGNED_SHORT,
                      volume.texels().data());
}

void LightTexture::set_light(const LookDesc& look, const View& view, const glm::vec3& to_light_in_head) {
  to_light_ = to_light_in_head;
  up_ = view.up;
  light_color_ = look.light_color;
  ambient_ = look.ambient;
}

void LightTexture::set_uniforms(const gl::Program& program, uint32_t unit) const {
  glBindTextureUnit(unit, texture_.name());
  program.set("u_light_volume", static_cast<int>(unit));
  program.set("u_volume_origin_m", origin_m_);
  program.set("u_volume_from_m", volume_from_m_);
  program.set("u_to_light", to_light_);
  program.set("u_up", up_);
  program.set("u_light_color", light_color_);
  program.set("u_ambient", ambient_);
}

}  // namespace strandcast
