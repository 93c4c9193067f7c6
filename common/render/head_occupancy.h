// HeadOccupancy: signed distance to the surface of head, neck and shoulders in cells of head space, for
// lighting. Computed once per asset, also from meshes with holes; no GL, any thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "common/groom/mesh.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

/// Largest number of cells (1 MiB); larger heads get larger cells.
inline constexpr uint64_t kMaxOccupancyCells = uint64_t{1} << 20;
/// Resolution of stored distances: steps per cell. Up to 127 steps are stored.
inline constexpr float kDistanceStepsPerCell = 8.0f;

struct HeadOccupancy {
  glm::vec3 origin_m{0.0f};  // middle of the first cell
  float cell_m = 1.0f;
  glm::ivec3 size{0};            // 0: nothing is solid
  bool has_ball = false;         // is also solid where no mesh is
  std::vector<int8_t> distance;  // (size.z x size.y x size.x) negative inside; see kDistanceStepsPerCell

  bool is_empty() const { return distance.empty(); }
  uint64_t size_bytes() const { return distance.capacity(); }
};

/// Part of the head that is examined, and the resolution.
struct OccupancyRequest {
  glm::vec3 low_m{-1.0f}, high_m{1.0f};  // what lies outside does not count
  float cell_m = 0.004f;
  std::optional<FittedSphere> ball;  // stands for a head that the mesh does not hold together
};

/// Computes the occupancy; empty if nothing is solid. A cell is solid if at least two of the axis-parallel
/// lines through it say so; a line through a hole of the mesh has no vote.
HeadOccupancy make_head_occupancy(const Mesh& mesh, const OccupancyRequest& request);
/// Computes the occupancy of an asset around its hair.
HeadOccupancy make_head_occupancy(const SceneAsset& asset, const std::optional<FittedSphere>& skull);

/// Returns the interpolated distance to the surface, m, negative inside. `place` is in cells from the middle
/// of the first cell; outside the grid the border's value applies. `head` must not be empty.
inline float distance_at(const HeadOccupancy& head, const glm::vec3& place) {
  const glm::vec3 at = glm::clamp(place, glm::vec3(0.0f), glm::vec3(head.size - 1));
  const glm::ivec3 low = glm::min(glm::ivec3(at), head.size - 2);
  const glm::vec3 part = at - glm::vec3(low);
  const size_t row = static_cast<size_t>(head.size.x);
  const size_t slice = row * static_cast<size_t>(head.size.y);
  const int8_t* const cell = head.distance.data() + static_cast<size_t>(low.z) * slice +
                             static_cast<size_t>(low.y) * row + static_cast<size_t>(low.x);
  const auto along_x = [&](size_t offset) {
    const auto from = static_cast<float>(cell[offset]);
    return from + part.x * (static_cast<float>(cell[offset + 1]) - from);
  };
  const float near = along_x(0) + part.y * (along_x(row) - along_x(0));
  const float far = along_x(slice) + part.y * (along_x(slice + row) - along_x(slice));
  return (near + part.z * (far - near)) * (head.cell_m / kDistanceStepsPerCell);
}

}  // namespace strandcast
