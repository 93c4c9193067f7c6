// PixelTarget: colour targets of the picture's size in which transparency methods accumulate. All calls from
// the context's thread.
#pragma once

#include <glm/glm.hpp>

#include <string>
#include <utility>
#include <vector>

#include "common/base/result.h"
#include "common/gl/objects.h"
#include "common/gl/pass_plan.h"

namespace strandcast {

class PixelTarget final : public gl::Resource {
 public:
  /// Declares a colour target for each format.
  PixelTarget(std::string name, std::vector<uint32_t> formats)
      : Resource(std::move(name)), formats_(std::move(formats)) {}

  /// Allocates for a picture of this size unless it already has it.
  Status resize(glm::uvec2 size_px);
  /// Fills target `index` with `value`.
  void clear(size_t index, float value) const;
  /// Binds the targets for drawing without depth; other state is off.
  void begin() const;
  const gl::Texture& texture(size_t index) const { return textures_[index]; }
  uint64_t size_bytes() const override;

 private:
  std::vector<uint32_t> formats_;
  std::vector<gl::Texture> textures_;
  gl::Framebuffer framebuffer_;
  glm::uvec2 size_px_{0};
};

/// Enables additive blending for the following draws; begin() of a target resets it.
void begin_adding();

}  // namespace strandcast
