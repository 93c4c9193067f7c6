#include "common/render/passes/light_texture.h"

#include <epoxy/gl.h>

namespace strandcast {

void LightTexture::upload(const LightVolume& volume) {
  if (size_ != volume.size()) {
    size_ = volume.size();
    const glm::uvec3 size(size_);
    texture_ = gl::Texture::volume("light volume", GL_RG16, size.x, size.y, size.z);
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
  light_color_ = look.exposure * look.light_color;
  ambient_ = look.exposure * look.ambient;
}

void LightTexture::set_uniforms(const gl::Program& program, uint32_t unit) const {
  texture_.bind(unit);
  program.set("u_light_volume", static_cast<int>(unit));
  program.set("u_volume_origin_m", origin_m_);
  program.set("u_volume_from_m", volume_from_m_);
  program.set("u_to_light", to_light_);
  program.set("u_up", up_);
  program.set("u_light_color", light_color_);
  program.set("u_ambient", ambient_);
}

}  // namespace strandcast
