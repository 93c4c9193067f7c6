// VolumeGrid: where the nodes of a hair volume lie. Cells are cubes of a lattice that stands still in head
// space; the grid is the part of it that the hair is in. Plain data, any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>

namespace strandcast {

/// Ranges of fewer nodes than this are done before another thread is awake.
inline constexpr size_t kNodesOfRange = 16'384;

/// Node (x, y, z) lies at cell_m * (first + (x, y, z)) in head space; x is the fastest.
struct VolumeGrid {
  float cell_m = 0.0f;
  glm::ivec3 first{0};   // lattice point of node 0
  glm::uvec3 nodes{0u};  // along each axis; at least 2 where there is hair

  size_t size() const { return size_t{nodes.x} * nodes.y * nodes.z; }
  size_t row_count() const { return size_t{nodes.y} * nodes.z; }
  size_t layer_size() const { return size_t{nodes.x} * nodes.y; }
  size_t index(uint32_t x, uint32_t y, uint32_t z) const { return (size_t{z} * nodes.y + y) * nodes.x + x; }

  bool operator==(const VolumeGrid&) const = default;
};

/// What a volume says of a place: length of hair per space, and how the hair there moves on the mean.
struct VolumeSample {
  glm::dvec3 velocity_mps{0.0};   // world axes, relative to the head joint
  double density_mpm3 = 0.0;      // metres of hair in a cubic metre
  glm::dvec3 gradient_mpm4{0.0};  // of the density, head space
  bool is_inside = false;         // of the grid
};

}  // namespace strandcast
