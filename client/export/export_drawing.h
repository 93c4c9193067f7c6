// ExportDrawing: strands of an export as pictures show them, by a client that can draw. One thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace strandcast {

/// Simulated strands that a drawn one hangs between, and how much on each; the shares sum to 1.
struct ExportGuides {
  glm::uvec3 strand{0};
  glm::vec3 share{1.0f, 0.0f, 0.0f};
};

/// Points of strands, strand after strand, root first.
struct ExportShape {
  std::vector<uint32_t> first_point;      // (strand_count + 1)
  std::vector<float> width_m;             // (point_count) diameter
  std::vector<ExportGuides> guides = {};  // (strand_count) of each; empty: not known
};

class ExportDrawing {
 public:
  virtual ~ExportDrawing() = default;
  /// Returns what is the same in all frames.
  virtual const ExportShape& shape() const = 0;
  /// Returns (point_count) points in head space; `position_m`: (vertex_count x strand_count) of the simulated
  /// strands, vertex-major.
  virtual std::vector<glm::vec3> points(const std::vector<glm::vec3>& position_m) = 0;
};

}  // namespace strandcast
