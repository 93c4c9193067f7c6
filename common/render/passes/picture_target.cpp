#include "common/render/passes/picture_target.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "common/gl/device_limits.h"

namespace strandcast {
void set_plain_state(glm::uvec2 viewport) {
  for (const GLenum off : {GL_BLEND, GL_CULL_FACE, GL_SCISSOR_TEST, GL_STENCIL_TEST, GL_FRAMEBUFFER_SRGB,
                           GL_RASTERIZER_DISCARD, GL_PRIMITIVE_RESTART, GL_SAMPLE_ALPHA_TO_COVERAGE})
    glDisable(off);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  glPolygonMode(GL_FRONT_AND_BACK, GL_FILL);
  glViewport(0, 0, static_cast<GLsizei>(viewport.x), static_cast<GLsizei>(viewport.y));
}

Status SceneTarget::resize(glm::uvec2 picture_px) {
  const glm::uvec2 size = picture_px * layout_.per_side;
  if (size == size_px_) return {};
  RETURN_IF_ERROR(
      gl::check_device_limit(gl::read_device_limits(), gl::DeviceLimit::TextureSize, std::max(size.x, size.y),
                             fmt::format("a picture of {} x {} pixels", picture_px.x, picture_px.y)));
  // The old ones first: two sizes side by side may not fit.
  size_px_ = glm::uvec2(0);
  framebuffer_ = {};
  color_ = {};
  depth_ = {};
  color_ = gl::Texture("scene color", layout_.color_format == 0 ? GL_RGBA16F : layout_.color_format, size.x,
                       size.y, layout_.multisamples);
  depth_ = gl::Texture("scene depth", GL_DEPTH_COMPONENT32F, size.x, size.y, layout_.multisamples);
  const std::array<const gl::Texture*, 1> colors{&color_};
  ASSIGN_OR_RETURN(framebuffer_, gl::Framebuffer::make("scene", colors, &depth_));
  size_px_ = size;
  return {};
}

void SceneTarget::begin() const {
  set_plain_state(size_px_);
  framebuffer_.bind();
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glDepthMask(GL_TRUE);
}

void SceneTarget::clear() const {
  const std::array<float, 4> nothing{0.0f, 0.0f, 0.0f, 0.0f};
  const float far = 1.0f;
  glClearNamedFramebufferfv(framebuffer_.name(), GL_COLOR, 0, nothing.data());
  glClearNamedFramebufferfv(framebuffer_.name(), GL_DEPTH, 0, &far);
}

Status StrandLayer::resize(glm::uvec2 picture_px) {
  if (picture_px == size_px_) return {};
  size_px_ = glm::uvec2(0);
  framebuffer_ = {};
  color_ = {};
  color_ = gl::Texture("strand layer", GL_RGBA16F, picture_px.x, picture_px.y, 1);
  const std::array<const gl::Texture*, 1> colors{&color_};
  ASSIGN_OR_RETURN(framebuffer_, gl::Framebuffer::make("strand layer", colors, nullptr));
  size_px_ = picture_px;
  return {};
}

void StrandLayer::begin() const {
  set_plain_state(size_px_);
  framebuffer_.bind();
  glDisable(GL_DEPTH_TEST);
}

Status PictureTarget::resize(glm::uvec2 picture_px) {
  if (picture_px == size_px_) return {};
  size_px_ = glm::uvec2(0);
  framebuffer_ = {};
  color_ = {};
  color_ = gl::Texture("picture", GL_RGBA8, picture_px.x, picture_px.y, 1);
  const std::array<const gl::Texture*, 1> colors{&color_};
  ASSIGN_OR_RETURN(framebuffer_, gl::Framebuffer::make("picture", colors, nullptr));
  size_px_ = picture_px;
  return {};
}

void PictureTarget::begin() const {
  set_plain_state(size_px_);
  framebuffer_.bind();
  glDisable(GL_DEPTH_TEST);
}

Image PictureTarget::read_image() const {
  Image image;
  image.width = size_px_.x;
  image.height = size_px_.y;
  image.rgba.resize(static_cast<size_t>(size_px_.x) * size_px_.y * 4);
  if (image.rgba.empty()) return image;
  glPixelStorei(GL_PACK_ALIGNMENT, 4);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer_.name());
  glReadPixels(0, 0, static_cast<GLsizei>(size_px_.x), static_cast<GLsizei>(size_px_.y), GL_RGBA,
               GL_UNSIGNED_BYTE, image.rgba.data());
  return image;
}

}  // namespace strandcast
