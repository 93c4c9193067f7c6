#include "common/render/transparency/pixel_target.h"

#include <epoxy/gl.h>

#include "common/render/passes/picture_target.h"

namespace strandcast {

Status PixelTarget::resize(glm::uvec2 size_px) {
  if (size_px == size_px_) return {};
  size_px_ = glm::uvec2(0);
  framebuffer_ = {};
  textures_.clear();
  std::vector<const gl::Texture*> colors;
  for (const uint32_t format : formats_) textures_.emplace_back(name(), format, size_px.x, size_px.y, 1);
  for (const gl::Texture& texture : textures_) colors.push_back(&texture);
  ASSIGN_OR_RETURN(framebuffer_, gl::Framebuffer::make(name(), colors, nullptr));
  size_px_ = size_px;
  return {};
}

void PixelTarget::clear(size_t index, float value) const {
  const float all[4] = {value, value, value, value};
  glClearNamedFramebufferfv(framebuffer_.name(), GL_COLOR, static_cast<GLint>(index), all);
}

void PixelTarget::begin() const {
  set_plain_state(size_px_);
  framebuffer_.bind();
  glDisable(GL_DEPTH_TEST);
}

uint64_t PixelTarget::size_bytes() const {
  uint64_t sum = 0;
  for (const gl::Texture& texture : textures_) sum += texture.size_bytes();
  return sum;
}

void begin_adding() {
  glEnable(GL_BLEND);
  glBlendEquation(GL_FUNC_ADD);
  glBlendFunc(GL_ONE, GL_ONE);
}

}  // namespace strandcast
