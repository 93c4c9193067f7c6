// Expand pass: key strands and followers through tessellation into a buffer of line segments, once per draw.
// The other passes pull their vertices from that buffer. Needs a bound framebuffer; all calls from the
// context's thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "common/base/result.h"
#include "common/gl/objects.h"
#include "common/gl/program.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

/// One end of an expanded segment, as shaders/render/strand.vert reads it.
struct ExpandedVertex {
  glm::vec3 position_m;  // head space
  float along;           // 0 at the root, 1 at the tip
  glm::vec3 tangent;     // unit, towards the tip
  uint32_t strand;       // key strands first, then followers
};
static_assert(sizeof(ExpandedVertex) == 32);

struct FollowerDesc {
  uint32_t per_triangle = 0;
  float clump = 0.0f;        // 0..1, pull towards the nearest key strand at the tip
  float variation_m = 0.0f;  // how far a tip strays from its interpolated place
  float shorten = 0.0f;      // 0..1, largest part cut off at the tip
};

/// Drawn segments per gap between two vertices, at most.
inline constexpr uint32_t kMaxSegmentsPerGap = 8;
/// Largest expanded buffer; more strands are expanded and drawn in several batches.
inline constexpr uint64_t kMaxExpandedBytes = 96ull << 20;

/// How finely one draw expands.
struct ExpandLevel {
  uint32_t segments_per_gap = 1;  // 1 .. the maximum given to make()
  uint32_t followers = 0;         // per triangle, at most FollowerDesc::per_triangle
};

class ExpandPass {
 public:
  ExpandPass() = default;
  /// The asset must have strands. Followers need triangles: without them none are drawn, and no code for them
  /// is compiled.
  static Result<ExpandPass> make(const gl::ShaderLibrary& shaders, const SceneAsset& asset,
                                 const FollowerDesc& followers, uint32_t max_segments_per_gap);

  /// `position_m`: (vertex_count x strand_count) head space.
  void upload(const std::vector<glm::vec3>& position_m);

  /// Key strands and followers together.
  uint32_t strand_count(uint32_t followers_per_triangle) const {
    return key_count_ + triangle_count_ * followers_per_triangle;
  }
  /// Followers per triangle at most; 0 without triangles.
  uint32_t max_followers() const { return followers_.per_triangle; }
  /// Strands that fit in the buffer at once.
  uint32_t batch_strands(uint32_t segments_per_gap) const;
  uint32_t segments_per_strand(uint32_t segments_per_gap) const {
    return segments_per_gap * (vertex_count_ - 1);
  }
  /// Expands strands first .. first + count - 1; count at most batch_strands(). Returns the segments written.
  uint32_t run(uint32_t first, uint32_t count, const ExpandLevel& level) const;

  /// (segments x 2) ExpandedVertex of the last run. Segments of one strand may come in any order.
  const gl::Buffer& expanded() const { return expanded_; }
  uint64_t size_bytes() const;

 private:
  gl::Program program_;
  gl::VertexArray no_attributes_;
  gl::Buffer key_position_;
  gl::Buffer root_triangle_;
  gl::Buffer expanded_;
  FollowerDesc followers_;
  uint32_t key_count_ = 0;
  uint32_t vertex_count_ = 0;
  uint32_t triangle_count_ = 0;
};

}  // namespace strandcast
