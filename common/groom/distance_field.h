// DistanceField: how far points are outside of a closed mesh, on a grid that strands look it up in
// (shaders/sim/field_collider.comp). Immutable data; making one is a pure function of any thread, the same
// bits for the same triangles in any order and on any number of threads.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "common/base/result.h"
#include "common/base/worker_pool.h"
#include "common/groom/mesh.h"
#include "common/kernels/strand_passes.h"

namespace strandcast {

/// Cells along the longest side of the mesh.
inline constexpr uint32_t kMinFieldResolution = 16;
inline constexpr uint32_t kMaxFieldResolution = 128;
inline constexpr uint32_t kDefaultFieldResolution = 64;
/// What a field may take: one of the largest resolution with a margin, for a mesh as wide as high.
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
  /// Trilinear between nodes; outside of the grid that of the nearest point in it.
  Sample sample(const glm::dvec3& point_m) const;
  uint64_t size_bytes() const { return quad.size() * sizeof(glm::vec4); }
};

/// Exact distances where the surface is near, and from there outwards and inwards the first-order solution of
/// the eikonal equation. What is inside is what triangles wind around more than half (generalised winding
/// number: Jacobson and others 2013, with the tree of Barill and others 2018, dipoles only), so small holes
/// count as closed, overlapping parts as one, and a mesh that is inside out as well. Triangles without area
/// do not count. BadInput in a sentence for a mesh without triangles or with numbers that are none, and for
/// one that has no inside to speak of: too open, or with parts inside out; LimitExceeded beyond
/// kMaxFieldBytes. `resolution` is in the range above.
Result<DistanceField> make_distance_field(const Mesh& mesh, uint32_t resolution,
                                          WorkerPool& workers = shared_workers());

/// Distance of a point from a triangle.
double distance_to_triangle_m(const glm::dvec3& point_m, const glm::dvec3& a, const glm::dvec3& b,
                              const glm::dvec3& c);

}  // namespace strandcast
