#include "common/render/passes/picture_target.h"

#include <epoxy/gl.h>

#include <array>

namespace strandcast {
namespace {

constexpr uint32_t kSceneUnit = 0;

// A window's user interface shares the context and leaves its own state behind.
void set_plain_state(glm::uvec2 viewport) {
  for (const GLenum off : {GL_BLEND, GL_CULL_FACE, GL_SCISSOR_TEST, GL_STENCIL_TEST, GL_FRAMEBUFFER_SRGB,
                           GL_RASTERIZER_DISCARD, GL_PRIMITIVE_RESTART, GL_SAMPLE_ALPHA_TO_COVERAGE})
    glDisable(off);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  glPolygonMode(GL_FRONT_AND_BACK, GL_FILL);
  glViewport(0, 0, static_cast<GLsizei>(viewport.x), static_cast<GLsizei>(viewport.y));
}

}  // namespace

Result<PictureTarget> PictureTarget::make(const gl::ShaderLibrary& shaders) {
  PictureTarget target;
  ASSIGN_OR_RETURN(target.program_,
                   gl::Program::make(shaders, {"render/resolve.vert", "render/resolve.frag"}, {}));
  target.no_attributes_ = gl::VertexArray("resolve");
  return target;
}

Status PictureTarget::resize(glm::uvec2 size) {
  if (size == size_) return {};
  // The old ones first: two sizes side by side may not fit.
  size_ = glm::uvec2(0);
  scene_ = {};
  picture_ = {};
  scene_color_ = {};
  scene_depth_ = {};
  picture_color_ = {};
  const glm::uvec2 scene = size * kSamplesPerSide;
  scene_color_ = gl::Texture("scene color", GL_RGBA16F, scene.x, scene.y, 1);
  scene_depth_ = gl::Texture("scene depth", GL_DEPTH_COMPONENT32F, scene.x, scene.y, 1);
  const std::array<const gl::Texture*, 1> scene_colors{&scene_color_};
  ASSIGN_OR_RETURN(scene_, gl::Framebuffer::make("scene", scene_colors, &scene_depth_));
  picture_color_ = gl::Texture("picture", GL_RGBA8, size.x, size.y, 1);
  const std::array<const gl::Texture*, 1> picture_colors{&picture_color_};
  ASSIGN_OR_RETURN(picture_, gl::Framebuffer::make("picture", picture_colors, nullptr));
  size_ = size;
  return {};
}

void PictureTarget::begin_scene() const {
  set_plain_state(scene_size());
  scene_.bind();
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glDepthMask(GL_TRUE);
  const std::array<float, 4> nothing{0.0f, 0.0f, 0.0f, 0.0f};
  const float far = 1.0f;
  glClearNamedFramebufferfv(scene_.name(), GL_COLOR, 0, nothing.data());
  glClearNamedFramebufferfv(scene_.name(), GL_DEPTH, 0, &far);
}

void PictureTarget::resolve(const glm::vec3& background) const {
  set_plain_state(size_);
  picture_.bind();
  glDisable(GL_DEPTH_TEST);
  program_.use();
  no_attributes_.bind();
  scene_color_.bind(kSceneUnit);
  program_.set("u_scene", static_cast<int>(kSceneUnit));
  program_.set("u_samples", static_cast<int>(kSamplesPerSide));
  program_.set("u_target_height", static_cast<int>(size_.y));
  program_.set("u_background", background);
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

Image PictureTarget::read_image() const {
  Image image;
  image.width = size_.x;
  image.height = size_.y;
  image.rgba.resize(static_cast<size_t>(size_.x) * size_.y * 4);
  if (image.rgba.empty()) return image;
  glPixelStorei(GL_PACK_ALIGNMENT, 4);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, picture_.name());
  glReadPixels(0, 0, static_cast<GLsizei>(size_.x), static_cast<GLsizei>(size_.y), GL_RGBA, GL_UNSIGNED_BYTE,
               image.rgba.data());
  return image;
}

void PictureTarget::blit_to(uint32_t framebuffer, glm::uvec2 size) const {
  const auto width = static_cast<GLint>(size_.x);
  const auto height = static_cast<GLint>(size_.y);
  glDisable(GL_SCISSOR_TEST);
  // The picture's first row is its top, the framebuffer's its bottom.
  glBlitNamedFramebuffer(picture_.name(), framebuffer, 0, height, width, 0, 0, 0, static_cast<GLint>(size.x),
                         static_cast<GLint>(size.y), GL_COLOR_BUFFER_BIT,
                         size == size_ ? GL_NEAREST : GL_LINEAR);
}

}  // namespace strandcast
