// Expand pass: expands key strands and followers by tessellation into a buffer of line segments, from which
// later passes pull their vertices. Needs a bound framebuffer; all calls from the context's thread.
#pragma once

#include <cstdint>
#include <memory>

#include "common/base/result.h"
#include "common/gl/objects.h"
#include "common/gl/program.h"
#include "common/render/passes/strand_buffers.h"
#include "common/render/passes/strand_curves.h"
#include "common/render/render_scene.h"
#include "common/render/render_turn.h"

namespace strandcast {

/// Largest number of drawn segments per gap between two vertices.
inline constexpr uint32_t kMaxSegmentsPerGap = 8;
/// Largest expanded buffer; more strands are expanded and drawn in several batches.
inline constexpr uint64_t kMaxExpandedBytes = 96ull << 20;

/// Sizes of an expansion, computed without GL.
class ExpandSizes {
 public:
  ExpandSizes(const KeyStrands& keys, uint32_t triangle_count, uint32_t followers_per_triangle)
      : key_count_(keys.strand_count()),
        vertex_count_(keys.vertex_count()),
        triangle_count_(triangle_count),
        max_followers_(triangle_count > 0 ? followers_per_triangle : 0) {}

  /// Returns the number of key strands and followers together.
  uint32_t strand_count(uint32_t followers) const { return key_count_ + triangle_count_ * followers; }
  /// Largest number of followers per triangle; 0 without triangles.
  uint32_t max_followers() const { return max_followers_; }
  uint32_t segments_per_strand(uint32_t segments_per_gap) const {
    return vertex_count_ > 0 ? segments_per_gap * (vertex_count_ - 1) : 0;
  }
  /// Returns the bytes of a buffer for all strands at once, at most kMaxExpandedBytes.
  uint64_t buffer_bytes(uint32_t max_segments_per_gap) const;
  /// Returns the number of strands that fit in a buffer of `size_bytes`.
  uint32_t batch_strands(uint64_t size_bytes, uint32_t segments_per_gap) const;

 private:
  uint32_t key_count_;
  uint32_t vertex_count_;
  uint32_t triangle_count_;
  uint32_t max_followers_;
};

/// GL part of the expansion: program and triangles.
class StrandExpander {
 public:
  StrandExpander() = default;
  /// Makes an expander; the asset must have strands. Without triangles no followers are drawn and no code for
  /// them is compiled.
  static Result<StrandExpander> make(const gl::ShaderLibrary& shaders, const SceneAsset& asset,
                                     const FollowerDesc& followers, CurveMethod curve = CurveMethod::Hermite);
  /// Expands strands first .. first + count - 1 into `expanded`. Returns the number of segments written.
  uint32_t run(const KeyStrands& keys, const ExpandedStrands& expanded, uint32_t first, uint32_t count,
               const ExpandLevel& level) const;
  uint64_t size_bytes() const { return curves_.size_bytes(); }

 private:
  StrandCurves curves_;
  gl::Program program_;
  gl::VertexArray no_attributes_;
};

/// Make the buffer of expanded strands, and the pass that writes it for later passes.
std::unique_ptr<ExpandedStrands> make_expanded_strands(const RenderScene& scene);
std::unique_ptr<RenderPass> make_expand_pass(RenderScene& scene, ExpandedStrands& expanded);
/// Make strands that only cast shadows, at the resolution of the light's map, and the pass that expands them.
std::unique_ptr<ExpandedStrands> make_casters(const RenderScene& scene);
std::unique_ptr<RenderPass> make_caster_pass(RenderScene& scene, ExpandedStrands& casters);

}  // namespace strandcast
