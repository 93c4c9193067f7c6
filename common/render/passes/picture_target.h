// Render targets of one picture size: the scene with several samples per pixel, and the picture that it is
// resolved into. All calls from the context's thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>

#include "common/base/result.h"
#include "common/gl/objects.h"
#include "common/gl/pass_plan.h"
#include "common/pictures/image_codec.h"

namespace strandcast {

/// Samples per pixel side: 2 x 2 samples in a grid cost half of 4 multisamples on llvmpipe and suit strands
/// thinner than a pixel equally well.
inline constexpr uint32_t kSamplesPerSide = 2;

/// Arrangement of a pixel's samples: a grid, drawn as a larger picture, or the rasteriser's multisamples.
struct SampleLayout {
  uint32_t per_side = kSamplesPerSide;
  uint32_t multisamples = 1;
  uint32_t color_format = 0;  // 0: linear RGB with coverage, of half floats
};

/// Resets the GL state so that draws write all of a target of this size. Other users of the context may have
/// left their own state.
void set_plain_state(glm::uvec2 viewport);

/// Target with linear RGB, coverage in alpha, and depth, per sample.
class SceneTarget final : public gl::Resource {
 public:
  SceneTarget() : Resource("scene") {}
  /// Sets the samples; call it before the first resize().
  void set_layout(const SampleLayout& layout) { layout_ = layout; }
  const SampleLayout& layout() const { return layout_; }
  /// Allocates for a picture of this size unless it already has it. LimitExceeded if OpenGL cannot; the
  /// target then has no size.
  Status resize(glm::uvec2 picture_px);
  /// Binds the target for drawing with its viewport and depth test; other state is off.
  void begin() const;
  void clear() const;
  const gl::Texture& color() const { return color_; }
  const gl::Texture& depth() const { return depth_; }
  /// Returns the size in samples; multisamples do not count.
  glm::uvec2 size_px() const { return size_px_; }
  /// Returns the bytes of colour and depth; 0 before the first resize().
  uint64_t size_bytes() const override { return color_.size_bytes() + depth_.size_bytes(); }

 private:
  gl::Texture color_;
  gl::Texture depth_;
  gl::Framebuffer framebuffer_;
  SampleLayout layout_;
  glm::uvec2 size_px_{0};  // without multisamples
};

/// Strands of a picture in a separate layer, to be blended over the scene: linear RGB times opacity, and
/// opacity, per pixel.
class StrandLayer final : public gl::Resource {
 public:
  StrandLayer() : Resource("strand layer") {}
  /// Allocates like SceneTarget::resize().
  Status resize(glm::uvec2 picture_px);
  /// Binds the target for drawing, without depth.
  void begin() const;
  const gl::Texture& color() const { return color_; }
  uint64_t size_bytes() const override { return color_.size_bytes(); }

 private:
  gl::Texture color_;
  gl::Framebuffer framebuffer_;
  glm::uvec2 size_px_{0};
};

/// The finished picture: sRGB, first row at the top.
class PictureTarget final : public gl::Resource {
 public:
  PictureTarget() : Resource("picture") {}
  /// Allocates like SceneTarget::resize().
  Status resize(glm::uvec2 picture_px);
  void begin() const;
  /// Reads the pixels, top row first.
  Image read_image() const;
  const gl::Texture& color() const { return color_; }
  glm::uvec2 size_px() const { return size_px_; }
  uint64_t size_bytes() const override { return color_.size_bytes(); }

 private:
  gl::Texture color_;
  gl::Framebuffer framebuffer_;
  glm::uvec2 size_px_{0};
};

}  // namespace strandcast
