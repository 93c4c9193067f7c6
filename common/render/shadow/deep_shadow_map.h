// Deep shadow map in double precision: for each texel of the light's map, the exact steps of light lost to
// every strand on its ray, without layers or cells. Reference for the other shadow methods. Any thread, no
// GL.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/render/passes/strand_buffers.h"
#include "common/render/shadow/light_frame.h"

namespace strandcast {

/// A step of optical depth: from `at_m` on along the ray of a texel, it is `depth`.
struct ShadowStep {
  float at_m = 0.0f;
  float depth = 0.0f;
};

class DeepShadowMap {
 public:
  /// Makes an empty map; `strand_opacity` is the optical depth of a strand that covers a whole texel.
  DeepShadowMap(const LightFrame& frame, double strand_opacity);

  /// Adds segments, two vertices each, with the strands' width at the root. Non-finite segments are ignored.
  void add(std::span<const ExpandedVertex> vertices, double width_m, double tip_scale);
  /// Completes the map after the last add(), before the first lookup.
  void finish();

  /// Returns the optical depth between a point and the light, interpolated from the steps of the four
  /// surrounding texels.
  double optical_depth(const glm::vec3& point_m) const;
  /// Returns the steps of one texel in order; steps that together change the light by less than `tolerance`
  /// are merged.
  std::vector<ShadowStep> steps(uint32_t x, uint32_t y, double tolerance) const;

 private:
  struct Crossing {
    double at_m;
    double depth;  // its own, and after finish() with all before it
    uint32_t texel;
  };
  void add_segment(const ExpandedVertex& from, const ExpandedVertex& to, double width_m, double tip_scale);
  std::span<const Crossing> ray(int x, int y) const;
  double depth_at(int x, int y, double at_m) const;

  LightFrame frame_;
  double strand_opacity_;
  std::vector<Crossing> crossings_;
  std::vector<uint32_t> first_;  // (texels x texels + 1) of each ray
};

}  // namespace strandcast
