// DistanceField: signed distance from a closed mesh on a grid, which strands look up
// (shaders/sim/field_collider.comp). Immutable. It is made by a pure function on any thread. The bits do not
// depend on the order of triangles or the number of threads.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "common/base/result.h"
#include "common/base/worker_pool.h"
#include "common/groom/mesh.h"
#include "common/kernels/strand_passes.h"

namespace strandcast {

/// Limits of the number of cells along the longest side of the mesh.
inline constexpr uint32_t kMinFieldResolution = 16;
inline constexpr uint32_t kMaxFieldResolution = 128;
inline constexpr uint32_t kDefaultFieldResolution = 64;
/// Memory limit of a field. It suffices for the finest resolution with a margin, for a mesh that is as wide
/// as high.
inline constexpr uint64_t kMaxFieldBytes = 64ull << 20;

struct DistanceField {
  glm::vec3 origin_m{0.0f};  // node (0, 0, 0); the space of the mesh
  float cell_m = 1.0f;
  glm::uvec3 node_count{0};  // at least 2 by axis
  // (node_count.z x node_count.y x node_count.x), x fastest: distances in m at the node, and at its
  // neighbours at x + 1, at y + 1 and at both. A lookup between nodes then takes two of them.
  std::vector<glm::vec4> quad;

  FieldGrid grid() const { return {origin_m, cell_m, node_count}; }
  struct Sample {
    double distance_m = 0.0;  // negative inside
    glm::dvec3 gradient{0.0};
  };
  /// Interpolates trilinearly between nodes; a point outside the grid gets the sample of the nearest point
  /// inside.
  Sample sample(const glm::dvec3& point_m) const;
  uint64_t size_bytes() const { return quad.size() * sizeof(glm::vec4); }
};

/// Computes the field. Distances are exact near the surface; farther away, first-order eikonal steps extend
/// them. `resolution` must be within the limits above.
/// A point is inside where the generalised winding number exceeds one half (Jacobson and others 2013). It is
/// evaluated with the tree of Barill and others 2018, with dipoles only. So small holes count as closed and
/// overlapping parts as one; a mesh may be inside out. Triangles without area are ignored.
/// BadInput: no triangles, non-finite numbers, or no clear inside (too open, or partly inside out).
/// LimitExceeded: beyond kMaxFieldBytes.
Result<DistanceField> make_distance_field(const Mesh& mesh, uint32_t resolution,
                                          WorkerPool& workers = shared_workers());

/// Distance of a point from the triangle a, b, c, in metres.
double distance_to_triangle_m(const glm::dvec3& point_m, const glm::dvec3& a, const glm::dvec3& b,
                              const glm::dvec3& c);

}  // namespace strandcast
