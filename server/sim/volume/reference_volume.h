// A hair volume by plain loops in double precision, which others are held against: Woodhouse 2017,
// equations 2.2 to 2.4, on the nodes of a given grid.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "common/kernels/volume/volume_grid.h"

namespace strandcast {

/// Hair in one place: in head space, and how it moves.
struct HairSample {
  glm::dvec3 in_head_m{0.0};
  glm::dvec3 velocity_mps{0.0};  // relative to the head joint
  double length_m = 0.0;
};

/// (nodes) mean velocity and density.
struct ReferenceVolume {
  VolumeGrid grid;
  std::vector<glm::dvec4> nodes;

  glm::dvec4& at(const glm::uvec3& node) { return nodes[grid.index(node.x, node.y, node.z)]; }

  /// [1 2 1] / 4 along each axis of all four numbers, or of the first three; beyond the grid is nothing.
  void smooth(bool is_velocity) {
    for (int axis = 0; axis < 3; ++axis) {
      const std::vector<glm::dvec4> before = nodes;
      for (uint32_t z = 0; z < grid.nodes.z; ++z)
        for (uint32_t y = 0; y < grid.nodes.y; ++y)
          for (uint32_t x = 0; x < grid.nodes.x; ++x) {
            glm::dvec4 sum = 0.5 * before[grid.index(x, y, z)];
            for (const int side : {-1, 1}) {
              glm::ivec3 other(static_cast<int>(x), static_cast<int>(y), static_cast<int>(z));
              other[axis] += side;
              if (other[axis] < 0 || other[axis] >= static_cast<int>(grid.nodes[axis])) continue;
              const glm::uvec3 node(other);
              sum += 0.25 * before[grid.index(node.x, node.y, node.z)];
            }
            glm::dvec4& to = at({x, y, z});
            if (is_velocity) sum.w = to.w;
            to = sum;
          }
    }
  }
};

inline ReferenceVolume make_reference_volume(const VolumeGrid& grid, const std::vector<HairSample>& samples,
                                             uint32_t smoothing) {
  ReferenceVolume volume{grid, std::vector<glm::dvec4>(grid.size(), glm::dvec4(0.0))};
  const auto cell_m = static_cast<double>(grid.cell_m);
  for (const HairSample& sample : samples) {
    const glm::dvec3 at = sample.in_head_m / cell_m - glm::dvec3(grid.first);
    const glm::dvec3 base = glm::floor(at);
    bool is_inside = true;
    for (int axis = 0; axis < 3; ++axis)
      is_inside = is_inside && base[axis] >= 0.0 && base[axis] + 1.0 < static_cast<double>(grid.nodes[axis]);
    if (!is_inside) continue;
    for (uint32_t corner = 0; corner < 8; ++corner) {
      const glm::uvec3 far(corner & 1u, (corner >> 1) & 1u, corner >> 2);
      double weight = sample.length_m;
      for (int axis = 0; axis < 3; ++axis) {
        const double share = at[axis] - base[axis];
        weight *= far[axis] != 0 ? share : 1.0 - share;
      }
      volume.at(glm::uvec3(base) + far) += weight * glm::dvec4(sample.velocity_mps, 1.0);
    }
  }
  for (uint32_t i = 0; i < smoothing; ++i) volume.smooth(false);
  for (glm::dvec4& node : volume.nodes) {
    const double length_m = node.w;
    node = length_m > 0.0 ? node / length_m : glm::dvec4(0.0);
    node.w = length_m / (cell_m * cell_m * cell_m);
  }
  for (uint32_t i = 0; i < smoothing; ++i) volume.smooth(true);
  return volume;
}

}  // namespace strandcast
