#include "common/kernels/volume/volume_extras.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "common/base/check.h"
#include "common/kernels/volume/volume_smooth.h"

namespace strandcast {
namespace {

// Of a plane of the sweep: rows and columns of no hair in front of the grid's, and behind them.
constexpr uint32_t kRowsBefore = 1;
constexpr uint32_t kRowsBehind = 2;

template <class Work>
void for_layers(const WorkerPool::Terms& terms, const VolumeGrid& grid, const Work& work) {
  const size_t grain = std::max<size_t>(kNodesOfRange / grid.layer_size(), 1);
  terms.for_ranges(grid.nodes.z, grain, [&](size_t begin, size_t end) {
    work(static_cast<uint32_t>(begin), static_cast<uint32_t>(end));
  });
}

/// Rows of a layer across the wind. Planes of numbers lie `pitch` apart from row to row; around the grid's
/// own there is no hair.
struct ShadowRows {
  const float* left = nullptr;     // of the wind, in the layer before
  const float* density = nullptr;  // of hair, there
  const float* own = nullptr;      // and in this one
  float* to = nullptr;             // of the wind that is left here
  float weight[4] = {};            // of the four nodes of the layer before that a node has upwind
  ptrdiff_t from = 0;              // way to the first of them
  uint32_t pitch = 0;
  uint32_t width = 0;
  uint32_t begin = 0;  // rows
  uint32_t end = 0;
  float depth = 0.0f;  // that hair of 1 m/m^3 has in a layer
  bool is_arriving = false;
};

STRANDCAST_LANES void cast_shadow_lanes(const ShadowRows& rows) {
  using simd::Float;
  const size_t corners[4] = {0, 1, rows.pitch, size_t{rows.pitch} + 1};
  for (uint32_t row = rows.begin; row < rows.end; ++row) {
    const size_t first = size_t{row} * rows.pitch;
    for (uint32_t column = 0; column < rows.width; column += simd::kLanes) {
      const size_t at = first + column;
      const float* const left_at = rows.left + rows.from + at;
      const float* const density_at = rows.density + rows.from + at;
      Float left = 0.0f;
      Float density = 0.0f;
      for (uint32_t corner = 0; corner < 4; ++corner) {
        left += Float(rows.weight[corner]) * simd::load_lanes(left_at + corners[corner]);
        density += Float(rows.weight[corner]) * simd::load_lanes(density_at + corners[corner]);
      }
      const Float own = rows.is_arriving ? density : simd::load_lanes(rows.own + at);
      // The project's own function: a library's differs from machine to machine.
      simd::store_lanes(left * simd::exp(Float(-0.5f * rows.depth) * (density + own)), rows.to + at);
    }
    // Lanes behind the last column are not the grid's.
    for (size_t i = rows.width; i < rows.width + kRowsBehind + simd::kLanes; ++i) rows.to[first + i] = 1.0f;
  }
}

STRANDCAST_KERNEL(cast_shadow, ShadowRows);

}  // namespace

TargetDensity make_target(const VolumeGrid& grid, std::span<const glm::vec4> nodes) {
  TargetDensity target{grid, {}};
  for (size_t i = 0; i < grid.size(); ++i) target.density_mpm3.push_back(nodes[i].w);
  return target;
}

void VolumeExtras::update(const VolumeGrid& grid, std::span<const glm::vec4> nodes,
                          const TargetDensity* target, const WindShadow* shadow) {
  CHECK(nodes.size() >= grid.size());
  if (target != nullptr) find_excess(grid, nodes, *target);
  wind_share_.assign(grid.size(), 1.0f);
  if (shadow != nullptr) sweep(grid, nodes, *shadow);
}

void VolumeExtras::find_excess(const VolumeGrid& grid, std::span<const glm::vec4> nodes,
                               const TargetDensity& target) {
  rows_.assign(grid.row_count(), 1);
  other_rows_.assign(grid.row_count(), 1);
  one_.resize(std::max(one_.size(), grid.size()));
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
          one_[row + x] = glm::vec4(nodes[row + x].w - wanted, 0.0f, 0.0f, 0.0f);
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
    pass(smooth_in_layers, one_.data(), other_.data());
    pass(smooth_across_layers, other_.data(), one_.data());
  }
  excess_mpm3_.resize(grid.size());
  for (size_t i = 0; i < grid.size(); ++i) excess_mpm3_[i] = one_[i].x;
}

/// Layer by layer along the axis that the wind goes along most: each node has what the place one layer upwind
/// has, less what the hair between takes (Beer and Lambert).
void VolumeExtras::sweep(const VolumeGrid& grid, std::span<const glm::vec4> nodes, const WindShadow& shadow) {
  const glm::vec3 along = shadow.along_in_head;
  int main = 0;
  for (int axis = 1; axis < 3; ++axis)
    if (std::abs(along[axis]) > std::abs(along[main])) main = axis;
  // Rows along the axis whose nodes lie nearest to each other.
  const int u = main == 0 ? 1 : 0;
  const int v = 3 - main - u;
  if (!(std::abs(along[main]) > 0.0f)) return;
  const glm::uvec3 size = grid.nodes;
  const glm::uvec3 stride(1, size.x, size.x * size.y);
  const bool is_forward = along[main] > 0.0f;
  const float per_layer = 1.0f / std::abs(along[main]);
  const float shift_u = -along[u] * per_layer;
  const float shift_v = -along[v] * per_layer;
  const float floor_u = std::floor(shift_u);
  const float floor_v = std::floor(shift_v);
  const float share_u = shift_u - floor_u;
  const float share_v = shift_v - floor_v;

  ShadowRows layer;
  layer.width = size[u];
  layer.pitch = size[u] + kRowsBefore + kRowsBehind + simd::kLanes;
  layer.depth = shadow.width_m * grid.cell_m * per_layer;
  layer.is_arriving = shadow.is_arriving;
  layer.from = static_cast<ptrdiff_t>(floor_v) * layer.pitch + static_cast<ptrdiff_t>(floor_u);
  const std::array<float, 4> weight = {(1.0f - share_u) * (1.0f - share_v), share_u * (1.0f - share_v),
                                       (1.0f - share_u) * share_v, share_u * share_v};
  std::copy(weight.begin(), weight.end(), layer.weight);
  const size_t plane_size = size_t{layer.pitch} * (size[v] + kRowsBefore + kRowsBehind);
  const size_t origin = size_t{kRowsBefore} * layer.pitch + kRowsBefore;
  left_.assign(2 * plane_size, 1.0f);
  density_.assign(2 * plane_size, 0.0f);
  all_density_.resize(grid.size());
  for (size_t i = 0; i < grid.size(); ++i) all_density_[i] = nodes[i].w;

  const size_t grain = std::max<size_t>(kNodesOfRange / size[u], 1);
  for (uint32_t step = 0; step < size[main]; ++step) {
    const size_t base = size_t{is_forward ? step : size[main] - 1 - step} * stride[main];
    const size_t now = step % 2 * plane_size + origin;
    const size_t before = (step + 1) % 2 * plane_size + origin;
    const auto density = [&](size_t row) {
      float* const to = density_.data() + now + row * layer.pitch;
      const size_t first = base + row * stride[v];
      for (size_t at = 0; at < size[u]; ++at) to[at] = all_density_[first + at * stride[u]];
    };
    terms().for_ranges(size[v], grain, [&](size_t begin, size_t end) {
      for (size_t row = begin; row < end; ++row) density(row);
      if (step == 0) return;
      ShadowRows rows = layer;
      rows.left = left_.data() + before;
      rows.density = density_.data() + before;
      rows.own = density_.data() + now;
      rows.to = left_.data() + now;
      rows.begin = static_cast<uint32_t>(begin);
      rows.end = static_cast<uint32_t>(end);
      cast_shadow(options_.set, rows);
      for (size_t row = begin; row < end; ++row) {
        const float* const from = left_.data() + now + row * layer.pitch;
        const size_t first = base + row * stride[v];
        for (size_t at = 0; at < size[u]; ++at) wind_share_[first + at * stride[u]] = from[at];
      }
    });
  }
}

void pack_corners(const VolumeGrid& grid, std::span<const float> values, std::span<glm::vec4> elements) {
  CHECK(values.size() >= grid.size() && elements.size() >= grid.size());
  const uint32_t nodes_x = grid.nodes.x;
  for (size_t row = 0; row < grid.row_count(); ++row) {
    const float* const here = values.data() + row * nodes_x;
    // Nobody looks between the last row or column and one behind it.
    const bool is_last = row % grid.nodes.y + 1 == grid.nodes.y;
    const float* const next = is_last ? here : here + nodes_x;
    glm::vec4* const to = elements.data() + row * nodes_x;
    for (uint32_t x = 0; x + 1 < nodes_x; ++x) to[x] = {here[x], here[x + 1], next[x], next[x + 1]};
    to[nodes_x - 1] = glm::vec4(here[nodes_x - 1]);
  }
}

}  // namespace strandcast
