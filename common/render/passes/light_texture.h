// LightTexture: the light volume on the GPU, with the uniforms of shaders/render/light.glsl. All calls from
// the context's thread.
#pragma once

#include <glm/glm.hpp>

#include "common/gl/objects.h"
#include "common/gl/pass_plan.h"
#include "common/gl/program.h"
#include "common/render/light_volume.h"
#include "common/render/view.h"
#include "common/scene/scene_desc.h"

namespace strandcast {

class LightTexture final : public gl::Resource {
 public:
  LightTexture() : Resource("light volume") {}
  /// Uploads the volume; reallocates if its size has changed.
  void upload(const LightVolume& volume);
  /// Sets key and ambient light as the shaders take them, in head space.
  void set_light(const LookDesc& look, const View& view, const glm::vec3& to_light_in_head);
  void set_uniforms(const gl::Program& program, uint32_t unit) const;
  /// Returns the texture's bytes, which depend on the extent of the hair; 0 before the first upload.
  uint64_t size_bytes() const override { return texture_.size_bytes(); }

 private:
  gl::Texture texture_;
  glm::ivec3 size_{0};
  glm::vec3 origin_m_{0.0f};
  glm::vec3 volume_from_m_{1.0f};
  glm::vec3 to_light_{0.0f, 1.0f, 0.0f};
  glm::vec3 up_{0.0f, 1.0f, 0.0f};
  glm::vec3 light_color_{1.0f};
  float ambient_ = 0.0f;
};

}  // namespace strandcast
