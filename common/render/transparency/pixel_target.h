// Colour targets of the picture's size that methods of transparency add up in. All calls from the context's
// thread.
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
  /// A colour target for each format.
  PixelTarget(std::string name, std::vector<uint32_t> formats)
      : Resource(std::move(name)), formats_(std::move(formats)) {}

  /// Allocates for a picture of this size, unless it has that size already.
  Status resize(glm::uvec2 size_px);
  /// All of target `index`.
  void clear(size_t index, float value) const;
  /// Makes it what is drawn into: without depth, nothing switched on.
  void begin() const;
  const gl::Texture& texture(size_t index) const { return textures_[index]; }
  uint64_t size_bytes() const override;

 private:
  std::vector<uint32_t> formats_;
  std::vector<gl::Texture> textures_;
  gl::Framebuffer framebuffer_;
  glm::uvec2 size_px_{0};
};

/// Adds what is drawn from now on; the state of targets is set by their begin().
void begin_adding();

}  // namespace strandcast
