// Targets of one picture size: the scene with several samples per pixel, and the resolved sRGB picture. All
// calls from the context's thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>

#include "common/base/result.h"
#include "common/gl/objects.h"
#include "common/gl/program.h"
#include "common/pictures/image_codec.h"

namespace strandcast {

/// Samples per pixel side: 2 x 2 samples in a grid cost half of 4 multisamples on llvmpipe and suit strands
/// thinner than a pixel equally well.
inline constexpr uint32_t kSamplesPerSide = 2;

class PictureTarget {
 public:
  PictureTarget() = default;
  static Result<PictureTarget> make(const gl::ShaderLibrary& shaders);

  /// Allocates for a picture of this size, unless it has that size already. LimitExceeded when OpenGL cannot;
  /// the target then has no size.
  Status resize(glm::uvec2 size);
  /// Binds and clears the scene target; viewport and depth state are set.
  void begin_scene() const;
  /// Scene over the background (linear RGB) into the picture.
  void resolve(const glm::vec3& background) const;
  /// Top row first.
  Image read_image() const;
  void blit_to(uint32_t framebuffer, glm::uvec2 size) const;

  glm::uvec2 size() const { return size_; }
  glm::uvec2 scene_size() const { return size_ * kSamplesPerSide; }

 private:
  gl::Program program_;
  gl::VertexArray no_attributes_;
  gl::Texture scene_color_;
  gl::Texture scene_depth_;
  gl::Framebuffer scene_;
  gl::Texture picture_color_;
  gl::Framebuffer picture_;
  glm::uvec2 size_{0};
};

}  // namespace strandcast
