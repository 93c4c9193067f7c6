// HeadOccupancy: where head, neck and shoulders are solid, for light: distances to the surface of the head's
// mesh in cells of head space. Found once per asset, from meshes with holes as well; no GL, any thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "common/groom/mesh.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

/// Cells at most: 1 MiB. A head that would take more has larger ones.
inline constexpr uint64_t kMaxOccupancyCells = uint64_t{1} << 20;
/// Distances are stored in such parts of a cell, up to 127 of them.
inline constexpr float kDistanceStepsPerCell = 8.0f;

struct HeadOccupancy {
  glm::vec3 origin_m{0.0f};  // middle of the first cell
  float cell_m = 1.0f;
  glm::ivec3 size{0};            // 0: nothing is solid
  std::vector<int8_t> distance;  // (size.z x size.y x size.x) negative inside; see kDistanceStepsPerCell

  bool is_empty() const { return distance.empty(); }
  uint64_t size_bytes() const { return distance.capacity(); }
};

/// What of a head is looked at, and how finely.
struct OccupancyRequest {
  glm::vec3 low_m{-1.0f}, high_m{1.0f};  // what lies outside does not count
  float cell_m = 0.004f;
  std::optional<FittedSphere> ball;  // stands for a head that the mesh does not hold together
};

/// Empty where there is nothing solid. A cell is solid where at least two of the lines through it along the
/// axes say so; a line through a hole of the mesh does not say anything.
HeadOccupancy make_head_occupancy(const Mesh& mesh, const OccupancyRequest& request);
/// Of an asset, in the surroundings of its hair.
HeadOccupancy make_head_occupancy(const SceneAsset& asset, const std::optional<FittedSphere>& skull);

/// Distance to the surface between the cells' middles, m, negative inside. `place` in cells from the first
/// cell's middle; beyond the grid as at its border. Not for an empty one.
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
