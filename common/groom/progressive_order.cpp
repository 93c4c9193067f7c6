#include "common/groom/progressive_order.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "common/base/hash.h"

namespace strandcast {
namespace {

// Between one radius and the next; nearer to 1 is more even and slower.
constexpr float kRadiusStep = 0.75f;
// 0.75^64 is 1e-8 of the extent, where float coordinates coincide anyway.
constexpr int kMaxLevels = 64;
constexpr uint32_t kNoStrand = std::numeric_limits<uint32_t>::max();

/// Taken points in hashed cells as wide as the radius. Taken points keep a distance of one radius, so a cell
/// holds few.
class TakenGrid {
 public:
  TakenGrid(std::span<const glm::vec3> points, const glm::vec3& corner, float radius)
      : points_(points), corner_(corner), cell_(radius), next_(points.size(), kNoStrand) {}

  /// Starts again with smaller cells and the given points.
  void rebuild(float radius, const std::vector<uint32_t>& taken) {
    cell_ = radius;
    size_t slots = 64;
    while (slots < taken.size() * 4) slots *= 2;
    first_.assign(slots, kNoStrand);
    count_ = 0;
    for (const uint32_t index : taken) insert(index);
  }

  void insert(uint32_t index) {
    if (++count_ > first_.size()) grow();
    link(index);
  }

  /// Distance to a taken point nearer than the radius (not always the nearest one), or infinity.
  float distance_within_radius(const glm::vec3& point) const {
    const Cell center = cell_of(point);
    for (const int x : kNearFirst) {
      for (const int y : kNearFirst) {
        for (const int z : kNearFirst) {
          const float distance = distance_in({center[0] + x, center[1] + y, center[2] + z}, point);
          if (distance < cell_) return distance;
        }
      }
    }
    return std::numeric_limits<float>::infinity();
  }

 private:
  using Cell = std::array<int64_t, 3>;
  static constexpr std::array<int, 3> kNearFirst = {0, -1, 1};

  Cell cell_of(const glm::vec3& point) const {
    const glm::vec3 scaled = glm::floor((point - corner_) / cell_);
    return {static_cast<int64_t>(scaled.x), static_cast<int64_t>(scaled.y), static_cast<int64_t>(scaled.z)};
  }

  size_t slot_of(const Cell& cell) const {
    uint64_t hash = 0;
    for (const int64_t axis : cell) {
      hash = (hash ^ static_cast<uint64_t>(axis)) * 0x9e3779b97f4a7c15ull;
      hash ^= hash >> 32;
    }
    return hash & (first_.size() - 1);
  }

  float distance_in(const Cell& cell, const glm::vec3& point) const {
    for (uint32_t index = first_[slot_of(cell)]; index != kNoStrand; index = next_[index]) {
      const float distance = glm::distance(points_[index], point);
      if (distance < cell_) return distance;
    }
    return std::numeric_limits<float>::infinity();
  }

  void grow() {
    std::vector<uint32_t> all;
    for (uint32_t index : first_) {
      for (; index != kNoStrand; index = next_[index]) all.push_back(index);
    }
    first_.assign(first_.size() * 4, kNoStrand);
    for (const uint32_t index : all) link(index);
  }

  void link(uint32_t index) {
    uint32_t& head = first_[slot_of(cell_of(points_[index]))];
    next_[index] = head;
    head = index;
  }

  std::span<const glm::vec3> points_;
  glm::vec3 corner_;
  float cell_;
  size_t count_ = 0;
  std::vector<uint32_t> first_;  // by slot
  std::vector<uint32_t> next_;   // by point
};

struct Bounds {
  glm::vec3 low{std::numeric_limits<float>::max()};
  glm::vec3 high{std::numeric_limits<float>::lowest()};
};

Bounds bounds_of(std::span<const glm::vec3> points) {
  Bounds bounds;
  for (const glm::vec3& point : points) {
    bounds.low = glm::min(bounds.low, point);
    bounds.high = glm::max(bounds.high, point);
  }
  return bounds;
}

/// Indices 0..count-1 in hashed order.
std::vector<uint32_t> hashed_order(uint32_t count, uint32_t seed) {
  std::vector<uint64_t> keys(count);
  const uint32_t salt = mix_u32(seed + 1);
  for (uint32_t i = 0; i < count; ++i) keys[i] = uint64_t{mix_u32(i ^ salt)} << 32 | i;
  std::sort(keys.begin(), keys.end());
  std::vector<uint32_t> order(count);
  for (uint32_t i = 0; i < count; ++i) order[i] = static_cast<uint32_t>(keys[i]);
  return order;
}

}  // namespace

std::vector<uint32_t> make_progressive_order(std::span<const glm::vec3> points, uint32_t limit,
                                             uint32_t seed) {
  limit = std::min(limit, static_cast<uint32_t>(points.size()));
  std::vector<uint32_t> taken;
  taken.reserve(limit);
  if (limit == 0) return taken;
  const Bounds bounds = bounds_of(points);
  // The distance of points that lie very close to each other is 0, as their squares are; their extent is not.
  const glm::vec3 extent = bounds.high - bounds.low;
  float radius = std::max({glm::distance(bounds.low, bounds.high), extent.x, extent.y, extent.z,
                           std::numeric_limits<float>::min()});
  TakenGrid grid(points, bounds.low, radius);
  std::vector<uint32_t> waiting = hashed_order(static_cast<uint32_t>(points.size()), seed);
  // Distance to some taken point: while it is below the radius the point need not be looked up again.
  std::vector<float> known_distance(points.size(), std::numeric_limits<float>::infinity());
  for (int level = 0; level < kMaxLevels && taken.size() < limit && !waiting.empty(); ++level) {
    grid.rebuild(radius, taken);
    size_t kept = 0;
    for (size_t i = 0; i < waiting.size() && taken.size() < limit; ++i) {
      const uint32_t index = waiting[i];
      if (known_distance[index] >= radius) known_distance[index] = grid.distance_within_radius(points[index]);
      if (known_distance[index] < radius) {
        waiting[kept++] = index;
        continue;
      }
      taken.push_back(index);
      grid.insert(index);
    }
    if (taken.size() == limit) break;
    waiting.resize(kept);
    radius *= kRadiusStep;
  }
  for (size_t i = 0; taken.size() < limit; ++i) taken.push_back(waiting[i]);
  return taken;
}

}  // namespace strandcast
