// Deep shadow map in double precision: of each texel of the light's map, where on its ray how much is taken
// off the light, of every strand, without layers or cells. The truth that the other methods are held against.
// Any thread, no GL.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/render/passes/strand_buffers.h"
#include "common/render/shadow/light_frame.h"

namespace strandcast {

/// From here on, along the ray of one texel, the optical depth is `depth`.
struct ShadowStep {
  float at_m = 0.0f;
  float depth = 0.0f;
};

class DeepShadowMap {
 public:
  /// `strand_opacity`: optical depth of a strand that covers all of a texel.
  DeepShadowMap(const LightFrame& frame, double strand_opacity);

  /// Segments as two vertices each, with the width of their strands at the root. What is not a number is left
  /// out.
  void add(std::span<const ExpandedVertex> vertices, double width_m, double tip_scale);
  /// After the last add(), before the first question.
  void finish();

  /// Between a point and the light: of the four texels round it, each by its own steps, then mixed.
  double optical_depth(const glm::vec3& point_m) const;
  /// Steps of one texel, in order; those that together change the light by less than `tolerance` are one.
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
