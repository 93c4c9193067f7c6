// Inputs of kernels that include shaders/render/strand_curves.glsl: locations of key strands and their
// followers. All calls from the context's thread.
#pragma once

#include <cstdint>

#include "common/gl/objects.h"
#include "common/gl/program.h"
#include "common/render/passes/strand_buffers.h"
#include "common/scene/strand_methods.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

struct FollowerDesc {
  uint32_t per_triangle = 0;
  float clump = 0.0f;        // 0..1, pull towards the nearest key strand at the tip
  float variation_m = 0.0f;  // how far a tip strays from its interpolated place
  float shorten = 0.0f;      // 0..1, largest part cut off at the tip
};

/// Resolution of the expansion for one draw.
struct ExpandLevel {
  uint32_t segments_per_gap = 1;  // 1 .. the maximum of the look; by need: at most
  uint32_t followers = 0;         // per triangle, at most FollowerDesc::per_triangle
};

class StrandCurves {
 public:
  StrandCurves() = default;
  /// Prepares the curves; without triangles there are no followers and no code for them is compiled.
  StrandCurves(const SceneAsset& asset, const FollowerDesc& followers, CurveMethod curve);
  gl::Variant variant() const;
  /// Sets the inputs of the active program.
  void set(const gl::Program& program, const KeyStrands& keys, const ExpandLevel& level) const;
  uint64_t size_bytes() const { return root_triangle_.size_bytes(); }

 private:
  FollowerDesc followers_;
  CurveMethod curve_ = CurveMethod::Hermite;
  gl::Buffer root_triangle_;
};

}  // namespace strandcast
