#include "common/render/scalp_cover.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>

#include "common/base/quantile.h"

namespace strandcast {
namespace {

// More roots of one cell say nothing new, and all roots of a hostile groom could lie in one.
constexpr size_t kMaxRootsPerCell = 64;

// Roots in cells as wide as the reach, so that only neighbouring cells are searched.
class RootGrid {
 public:
  RootGrid(const glm::vec3* root_m, uint32_t count, float cell_m) : root_m_(root_m), cell_m_(cell_m) {
    for (uint32_t i = 0; i < count; ++i) {
      std::vector<uint32_t>& cell = cells_[key(cell_of(root_m[i]))];
      if (cell.size() < kMaxRootsPerCell) cell.push_back(i);
    }
  }

  // Weight of the roots around a point: 1 for a root at the point, 0 for one at the reach.
  float weight_at(const glm::vec3& point_m) const {
    float sum = 0.0f;
    const glm::ivec3 middle = cell_of(point_m);
    for (int i = 0; i < 27; ++i) {
      const auto found = cells_.find(key(middle + glm::ivec3(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1)));
      if (found == cells_.end()) continue;
      for (const uint32_t root : found->second)
        sum += std::max(0.0f, 1.0f - glm::length(root_m_[root] - point_m) / cell_m_);
    }
    return sum;
  }

 private:
  glm::ivec3 cell_of(const glm::vec3& point_m) const {
    // What is no number counts as far away.
    const auto part = [&](float value_m) {
      constexpr float kFar = 1e6f;
      const float cell = value_m / cell_m_;
      return cell > -kFar ? static_cast<int>(std::floor(std::min(cell, kFar))) : static_cast<int>(-kFar);
    };
    return {part(point_m.x), part(point_m.y), part(point_m.z)};
  }
  static uint64_t key(const glm::ivec3& cell) {
    const auto part = [](int value) { return static_cast<uint64_t>(value + (1 << 20)) & 0x1fffff; };
    return part(cell.x) | part(cell.y) << 21 | part(cell.z) << 42;
  }

  const glm::vec3* root_m_;
  float cell_m_;
  std::unordered_map<uint64_t, std::vector<uint32_t>> cells_;
};

// Full cover at this share of the median weight around roots: the middle of the hair is covered evenly.
constexpr float kFullShare = 0.5f;
constexpr uint32_t kMedianSamples = 256;

}  // namespace

std::vector<float> scalp_cover(const SceneAsset& asset, float reach_m) {
  std::vector<float> cover(asset.head.position_m.size(), 0.0f);
  if (cover.empty() || asset.strand_count == 0 || !(reach_m > 0.0f)) return cover;
  const RootGrid grid(asset.rest_position_m.data(), asset.strand_count, reach_m);
  std::vector<float> around;
  const uint32_t step = asset.strand_count / kMedianSamples + 1;
  for (uint32_t i = 0; i < asset.strand_count; i += step)
    around.push_back(grid.weight_at(asset.rest_position_m[i]));
  const float full = kFullShare * median(std::move(around));
  for (size_t i = 0; i < cover.size(); ++i)
    cover[i] = std::min(1.0f, grid.weight_at(asset.head.position_m[i]) / full);
  return cover;
}

}  // namespace strandcast
