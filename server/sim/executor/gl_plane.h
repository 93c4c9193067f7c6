// Planes and tables of the OpenGL executor, and their bindings for kernels. Needs the executor's context.
#pragma once

#include <epoxy/gl.h>

#include <array>
#include <optional>
#include <string>

#include "common/base/check.h"
#include "common/gl/objects.h"
#include "server/sim/executor/executor.h"
#include "shaders/shared/bindings.h"

namespace strandcast {

/// Binding of a plane by its role. Kernels do not store to all of them.
struct PlaneBinding {
  uint32_t unit;
  std::optional<uint32_t> storage;
};
inline constexpr std::array<PlaneBinding, kPlaneRoleCount> kPlaneBindings = {{
    {shader::kUnitRest, {}},
    {shader::kUnitPosition, shader::kBindingPosition},
    {shader::kUnitVelocity, shader::kBindingVelocity},
    {shader::kUnitDisplacement, shader::kBindingDisplacement},
    {shader::kUnitVelocityChange, shader::kBindingVelocityChange},
    {shader::kUnitRodEdge, {}},
    {shader::kUnitRodStrand, {}},
    {shader::kUnitRodAxis, shader::kBindingRodAxis},
    {shader::kUnitPlaceBefore, shader::kBindingPlaceBefore},
    {shader::kUnitRestDensity, {}},
}};
inline constexpr std::array<uint32_t, kTableRoleCount> kTableUnits = {shader::kUnitField, shader::kUnitVolume,
                                                                      shader::kUnitBody};

/// A buffer of vec4 with a buffer texture over all of it. Kernels write to the buffer and fetch from the
/// texture, which costs at most half of a storage-block load on llvmpipe.
class GlPlane final : public StrandPlane {
 public:
  GlPlane(const std::string& label, std::span<const glm::vec4> values)
      : buffer_(label, std::as_bytes(values)),
        view_(gl::Texture::view_of(label, GL_RGBA32F, buffer_)),
        count_(values.size()) {}

  void bind(const PlaneBinding& binding) const {
    if (binding.storage) buffer_.bind_storage(*binding.storage);
    view_.bind(binding.unit);
  }
  void write(std::span<const glm::vec4> values) override {
    CHECK(values.size() == count_);
    buffer_.write(0, std::as_bytes(values));
  }
  void read(std::vector<glm::vec4>& values) const override {
    values.resize(count_);
    buffer_.read(0, std::as_writable_bytes(std::span(values)));
  }
  uint64_t size_bytes() const override { return buffer_.size_bytes(); }
  const gl::Buffer& buffer() const { return buffer_; }

 private:
  gl::Buffer buffer_;
  gl::Texture view_;
  size_t count_;
};

class GlTable final : public LookupTable {
 public:
  GlTable(const std::string& label, uint32_t element_count)
      : plane_(label, std::vector<glm::vec4>(element_count, glm::vec4(0.0f))) {}

  void bind(uint32_t unit) const { plane_.bind({unit, {}}); }
  const gl::Buffer& buffer() const { return plane_.buffer(); }
  void write(std::span<const glm::vec4> values) override { plane_.write(values); }
  uint64_t size_bytes() const override { return plane_.size_bytes(); }

 private:
  GlPlane plane_;
};

}  // namespace strandcast
