// Targets of one picture size: the scene with several samples per pixel, and the picture that it is resolved
// into. All calls from the context's thread.
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

/// Samples of the scene in a pixel: a grid that is drawn as a larger picture, or the rasteriser's own.
struct SampleLayout {
  uint32_t per_side = kSamplesPerSide;
  uint32_t multisamples = 1;
  uint32_t color_format = 0;  // 0: linear RGB with coverage, of half floats
};

/// Nothing switched on but writing to all of a target of this size. Whoever else uses the context may leave
/// its own state behind.
void set_plain_state(glm::uvec2 viewport);

/// Linear RGB with coverage in alpha, and depth, per sample.
class SceneTarget final : public gl::Resource {
 public:
  SceneTarget() : Resource("scene") {}
  /// Before the first resize().
  void set_layout(const SampleLayout& layout) { layout_ = layout; }
  const SampleLayout& layout() const { return layout_; }
  /// Allocates for a picture of this size, unless it has that size already. LimitExceeded when OpenGL cannot;
  /// the target then has no size.
  Status resize(glm::uvec2 picture_px);
  /// Makes it what is drawn into: viewport, depth test, nothing else switched on.
  void begin() const;
  void clear() const;
  const gl::Texture& color() const { return color_; }
  const gl::Texture& depth() const { return depth_; }
  /// In samples, multisamples not counted.
  glm::uvec2 size_px() const { return size_px_; }
  /// 0 before the first resize().
  uint64_t size_bytes() const override { return color_.size_bytes() + depth_.size_bytes(); }

 private:
  gl::Texture color_;
  gl::Texture depth_;
  gl::Framebuffer framebuffer_;
  SampleLayout layout_;
  glm::uvec2 size_px_{0};  // without multisamples
};

/// Strands of a picture by themselves, as they are blended over the scene: linear RGB times opacity, and
/// opacity, per pixel.
class StrandLayer final : public gl::Resource {
 public:
  StrandLayer() : Resource("strand layer") {}
  /// As SceneTarget.
  Status resize(glm::uvec2 picture_px);
  /// Makes it what is drawn into, without depth.
  void begin() const;
  const gl::Texture& color() const { return color_; }
  uint64_t size_bytes() const override { return color_.size_bytes(); }

 private:
  gl::Texture color_;
  gl::Framebuffer framebuffer_;
  glm::uvec2 size_px_{0};
};

/// sRGB, first row at the top.
class PictureTarget final : public gl::Resource {
 public:
  PictureTarget() : Resource("picture") {}
  /// As SceneTarget.
  Status resize(glm::uvec2 picture_px);
  void begin() const;
  /// Top row first.
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
