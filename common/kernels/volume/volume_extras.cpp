#include "common/kernels/volume/volume_extras.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/kernels/volume/volume_smooth.h"

namespace strandcast {
namespace {

constexpr size_t kLayerGrain = 4;

template <class Work>
void for_layers(const WorkerPool::Terms& terms, const VolumeGrid& grid, const Work& work) {
  terms.for_ranges(grid.nodes.z, kLayerGrain, [&](size_t begin, size_t end) {
    work(static_cast<uint32_t>(begin), static_cast<uint32_t>(end));
  });
}

}  // namespace

TargetDensity make_target(const VolumeGrid& grid, std::span<const glm::vec4> nodes) {
  TargetDensity target{grid, {}};
  for (size_t i = 0; i < grid.size(); ++i) target.density_mpm3.push_back(nodes[i].w);
  return target;
}

void VolumeExtras::update(const VolumeGrid& grid, std::span<const glm::vec4> nodes,
                          const TargetDensity* target, const WindShadow* shadow,
                          std::span<glm::vec4> extras) {
  CHECK(extras.size() >= grid.size() && nodes.size() >= grid.size());
  if (target != nullptr) find_excess(grid, nodes, *target, extras);
  for_layers(terms(), grid, [&](uint32_t begin, uint32_t end) {
    const size_t layer = grid.layer_size();
    for (size_t i = begin * layer; i < end * layer; ++i)
      extras[i] = glm::vec4(target != nullptr ? extras[i].x : 0.0f, 1.0f, 0.0f, 0.0f);
  });
  if (shadow != nullptr) sweep(grid, nodes, *shadow, extras);
}

void VolumeExtras::find_excess(const VolumeGrid& grid, std::span<const glm::vec4> nodes,
                               const TargetDensity& target, std::span<glm::vec4> extras) {
  rows_.assign(grid.row_count(), 1);
  other_rows_.assign(grid.row_count(), 1);
  other_.resize(std::max(other_.size(), grid.size()));
  // Both lie on the same lattice.
  CHECK(target.grid.cell_m == grid.cell_m);
  const glm::ivec3 shift = grid.first - target.grid.first;
  const glm::ivec3 target_nodes(target.grid.nodes);
  for_layers(terms(), grid, [&](uint32_t begin, uint32_t end) {
    for (uint32_t z = begin; z < end; ++z)
      for (uint32_t y = 0; y < grid.nodes.y; ++y) {
        const size_t row = grid.index(0, y, z);
        const int32_t other_y = static_cast<int32_t>(y) + shift.y;
        const int32_t other_z = static_cast<int32_t>(z) + shift.z;
        const bool is_beside =
            other_y < 0 || other_z < 0 || other_y >= target_nodes.y || other_z >= target_nodes.z;
        for (uint32_t x = 0; x < grid.nodes.x; ++x) {
          const int32_t other_x = static_cast<int32_t>(x) + shift.x;
          float wanted = 0.0f;
          if (!is_beside && other_x >= 0 && other_x < target_nodes.x)
            wanted = target.density_mpm3[target.grid.index(static_cast<uint32_t>(other_x),
                                                           static_cast<uint32_t>(other_y),
                                                           static_cast<uint32_t>(other_z))];
          extras[row + x] = glm::vec4(nodes[row + x].w - wanted, 0.0f, 0.0f, 0.0f);
        }
      }
  });
  const auto pass = [&](auto kernel, const glm::vec4* from, glm::vec4* to) {
    for_layers(terms(), grid, [&](uint32_t begin, uint32_t end) {
      VolumeSmooth work;
      work.nodes = grid.nodes;
      work.from = from;
      work.from_rows = rows_.data();
      work.to = to;
      work.to_rows = other_rows_.data();
      work.begin = begin;
      work.end = end;
      kernel(options_.set, work);
    });
  };
  for (uint32_t i = 0; i < options_.smoothing; ++i) {
    pass(smooth_in_layers, extras.data(), other_.data());
    pass(smooth_across_layers, other_.data(), extras.data());
  }
}

/// Layer by layer along the axis that the wind goes along most: each node has what the place one layer upwind
/// has, less what the hair between takes (Beer and Lambert).
void VolumeExtras::sweep(const VolumeGrid& grid, std::span<const glm::vec4> nodes, const WindShadow& shadow,
                         std::span<glm::vec4> extras) const {
  const glm::vec3 along = shadow.along_in_head;
  int main = 0;
  for (int axis = 1; axis < 3; ++axis)
    if (std::abs(along[axis]) > std::abs(along[main])) main = axis;
  const int u = (main + 1) % 3;
  const int v = (main + 2) % 3;
  if (!(std::abs(along[main]) > 0.0f)) return;
  const glm::ivec3 size(grid.nodes);
  const glm::ivec3 stride(1, size.x, size.x * size.y);
  const bool is_forward = along[main] > 0.0f;
  const float per_layer = 1.0f / std::abs(along[main]);
  const float shift_u = -along[u] * per_layer;
  const float shift_v = -along[v] * per_layer;
  const float depth = shadow.width_m * grid.cell_m * per_layer;
  const auto floor_u = static_cast<int>(std::floor(shift_u));
  const auto floor_v = static_cast<int>(std::floor(shift_v));
  const float share_u = shift_u - static_cast<float>(floor_u);
  const float share_v = shift_v - static_cast<float>(floor_v);
  const float weight[4] = {(1.0f - share_u) * (1.0f - share_v), share_u * (1.0f - share_v),
                           (1.0f - share_u) * share_v, share_u * share_v};
  constexpr size_t kRowGrain = 8;
  for (int step = 1; step < size[main]; ++step) {
    const int layer = is_forward ? step : size[main] - 1 - step;
    const int before = is_forward ? layer - 1 : layer + 1;
    terms().for_ranges(static_cast<size_t>(size[v]), kRowGrain, [&](size_t begin, size_t end) {
      for (auto at_v = static_cast<int>(begin); at_v < static_cast<int>(end); ++at_v)
        for (int first_u = 0; first_u < size[u]; first_u += static_cast<int>(simd::kLanes)) {
          float lefts[simd::kLanes] = {};
          float depths[simd::kLanes] = {};
          const int last_u = std::min(first_u + static_cast<int>(simd::kLanes), size[u]);
          for (int at_u = first_u; at_u < last_u; ++at_u) {
            float left = 0.0f;
            float density = 0.0f;
            for (int corner = 0; corner < 4; ++corner) {
              const int from_u = at_u + floor_u + (corner & 1);
              const int from_v = at_v + floor_v + (corner >> 1);
              // Beside the grid is no hair.
              const bool is_in = from_u >= 0 && from_v >= 0 && from_u < size[u] && from_v < size[v];
              const int from = before * stride[main] + from_u * stride[u] + from_v * stride[v];
              left += weight[corner] * (is_in ? extras[static_cast<size_t>(from)].y : 1.0f);
              density += weight[corner] * (is_in ? nodes[static_cast<size_t>(from)].w : 0.0f);
            }
            const auto to = static_cast<size_t>(layer * stride[main] + at_u * stride[u] + at_v * stride[v]);
            lefts[at_u - first_u] = left;
            const float own = shadow.is_arriving ? density : nodes[to].w;
            depths[at_u - first_u] = -0.5f * depth * (density + own);
          }
          // The project's own function: a library's differs from machine to machine.
          simd::store_lanes(simd::load_lanes(lefts) * simd::exp(simd::load_lanes(depths)), lefts);
          for (int at_u = first_u; at_u < last_u; ++at_u)
            extras[static_cast<size_t>(layer * stride[main] + at_u * stride[u] + at_v * stride[v])].y =
                lefts[at_u - first_u];
        }
    });
  }
}

}  // namespace strandcast
