// Buffers of strands on the GPU: decoded key strands and the segments that they are expanded into. The passes
// that write them allocate them. All calls that touch GL come from the context's thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <utility>

#include "common/gl/objects.h"
#include "common/gl/pass_plan.h"

namespace strandcast {

/// Key strands: (vertex_count x strand_count) packed vec3, vertex-major, head space, m.
class KeyStrands final : public gl::Resource {
 public:
  KeyStrands(uint32_t strand_count, uint32_t vertex_count)
      : Resource("key strands"), strand_count_(strand_count), vertex_count_(vertex_count) {}
  void allocate() { position_ = gl::Buffer("key position", size_bytes()); }
  gl::Buffer& position() { return position_; }
  const gl::Buffer& position() const { return position_; }
  uint32_t strand_count() const { return strand_count_; }
  uint32_t vertex_count() const { return vertex_count_; }
  uint64_t size_bytes() const override { return sizeof(glm::vec3) * uint64_t{strand_count_} * vertex_count_; }

 private:
  uint32_t strand_count_;
  uint32_t vertex_count_;
  gl::Buffer position_;
};

/// One end of an expanded segment, as shaders/render/strand.vert reads it.
struct ExpandedVertex {
  glm::vec3 position_m;  // head space
  float along;           // 0 at the root, 1 at the tip
  glm::vec3 tangent;     // unit, towards the tip
  uint32_t strand;       // key strands first, then followers
};
static_assert(sizeof(ExpandedVertex) == 32);
inline constexpr uint64_t kSegmentBytes = 2 * sizeof(ExpandedVertex);

/// Expanded strands: (segments x 2) ExpandedVertex of the last expansion. Segments of one strand may be in
/// any order.
class ExpandedStrands final : public gl::Resource {
 public:
  explicit ExpandedStrands(uint64_t size_bytes, std::string name = "expanded strands")
      : Resource(std::move(name), size_bytes) {}
  void allocate() { vertex_ = gl::Buffer("expanded", size_bytes()); }
  const gl::Buffer& vertex() const { return vertex_; }

  // What is in the buffer now.
  uint32_t segment_count = 0;
  float width_m = 0.0f;  // of a strand at its root

 private:
  gl::Buffer vertex_;
};

}  // namespace strandcast
