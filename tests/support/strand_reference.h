// Reference in double precision of what the strand shaders compute, written from the equations: Hermite
// curves, followers between three key strands, coverage. Shares no code with the shaders. For shading see
// common/render/scatter.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace strandcast::reference {

/// Strands as the renderer gets them: (vertex_count x strand_count) vertex-major.
struct Keys {
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;
  std::vector<glm::vec3> position_m;

  glm::dvec3 vertex(uint32_t strand, uint32_t index) const {
    return glm::dvec3(position_m[static_cast<size_t>(index) * strand_count + strand]);
  }
};

struct CurvePoint {
  glm::dvec3 position_m{0.0};
  glm::dvec3 derivative{0.0};
};

/// Cubic Hermite with tangents (p[i+1] - p[i-1]) / 2, one-sided at the ends, at x = gap + t.
CurvePoint curve_point(const Keys& keys, uint32_t strand, uint32_t gap, double t);

struct FollowerStyle {
  double clump = 0.0;
  double variation_m = 0.0;
  double shorten = 0.0;
};

/// Barycentric weights of a follower from its hash.
glm::dvec3 follower_weights(uint32_t follower);
/// Weights pulled towards the largest by the share `clump`.
glm::dvec3 clumped_weights(const glm::dvec3& weights, double clump);
/// Point `along` (0..1) a follower between the key strands of `corner`.
CurvePoint follower_point(const Keys& keys, const glm::uvec3& corner, uint32_t follower, double along,
                          const FollowerStyle& style);

/// Part of a pixel that a line covers, box filter of one pixel across the line.
double line_coverage(double width_px, double distance_px);

}  // namespace strandcast::reference
