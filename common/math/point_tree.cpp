#include "common/math/point_tree.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace strandcast {
namespace {

constexpr uint32_t kLeafSize = 8;
constexpr float kBoxRounding = 1.0f - 1e-6f;
constexpr uint8_t kNoAxis = 3;  // of points that coincide

uint8_t widest_axis(std::span<const glm::vec3> points, std::span<const uint32_t> order) {
  glm::vec3 low = points[order.front()], high = low;
  for (const uint32_t index : order) {
    low = glm::min(low, points[index]);
    high = glm::max(high, points[index]);
  }
  const glm::vec3 extent = high - low;
  if (extent == glm::vec3(0.0f)) return kNoAxis;
  if (extent.x >= extent.y && extent.x >= extent.z) return 0;
  return extent.y >= extent.z ? 1 : 2;
}

}  // namespace

/// State of one nearest() call: a max-heap of the best so far.
struct PointTree::Search {
  glm::vec3 center;
  uint32_t count;
  glm::vec3 away_m;  // from the box of the points that are looked at, by axis
  std::vector<Neighbour> heap;

  /// Whether that box may hold a better one, rounding aside. Points that are as near count by their index.
  bool wants_box() const {
    return heap.size() < count || kBoxRounding * glm::dot(away_m, away_m) <= heap.front().distance_squared;
  }
  /// Whether it is among the best.
  bool offer(const Neighbour& candidate) {
    if (heap.size() == count) {
      if (!(candidate < heap.front())) return false;
      std::pop_heap(heap.begin(), heap.end());
      heap.back() = candidate;
    } else {
      heap.push_back(candidate);
    }
    std::push_heap(heap.begin(), heap.end());
    return true;
  }
};

PointTree::PointTree(std::span<const glm::vec3> points)
    : points_(points),
      order_(points.size()),
      split_axis_(points.size(), 0),
      low_m_(points.empty() ? glm::vec3(0.0f) : points.front()),
      high_m_(low_m_) {
  std::iota(order_.begin(), order_.end(), 0u);
  build(0, static_cast<uint32_t>(points.size()));
  for (const glm::vec3& point : points) {
    low_m_ = glm::min(low_m_, point);
    high_m_ = glm::max(high_m_, point);
  }
}

void PointTree::build(uint32_t begin, uint32_t end) {
  if (end - begin <= kLeafSize) return;
  const uint8_t axis = widest_axis(points_, std::span(order_).subspan(begin, end - begin));
  const uint32_t middle = begin + (end - begin) / 2;
  split_axis_[middle] = axis;
  if (axis == kNoAxis) {
    std::sort(order_.begin() + begin, order_.begin() + end);
    return;
  }
  std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                   [&](uint32_t a, uint32_t b) {
                     const float at_a = points_[a][axis], at_b = points_[b][axis];
                     return at_a != at_b ? at_a < at_b : a < b;
                   });
  build(begin, middle);
  build(middle + 1, end);
}

void PointTree::visit(uint32_t begin, uint32_t end, Search& search) const {
  const auto offer = [&](uint32_t slot) {
    const glm::vec3 offset = points_[order_[slot]] - search.center;
    return search.offer({glm::dot(offset, offset), order_[slot]});
  };
  if (end - begin <= kLeafSize) {
    for (uint32_t slot = begin; slot < end; ++slot) offer(slot);
    return;
  }
  const uint32_t middle = begin + (end - begin) / 2;
  const uint8_t axis = split_axis_[middle];
  if (axis == kNoAxis) {
    for (uint32_t slot = begin; slot < end && offer(slot); ++slot) continue;
    return;
  }
  const float offset = search.center[axis] - points_[order_[middle]][axis];
  const bool is_low_first = offset < 0.0f;
  visit(is_low_first ? begin : middle + 1, is_low_first ? middle : end, search);
  offer(middle);
  const float before_m = search.away_m[axis];
  search.away_m[axis] = std::max(before_m, std::abs(offset));
  if (search.wants_box()) visit(is_low_first ? middle + 1 : begin, is_low_first ? end : middle, search);
  search.away_m[axis] = before_m;
}

std::vector<PointTree::Neighbour> PointTree::nearest(const glm::vec3& center, uint32_t count) const {
  if (count == 0) return {};
  Search search{center, count, center - glm::clamp(center, low_m_, high_m_), {}};
  search.away_m = glm::abs(search.away_m);
  search.heap.reserve(count);
  visit(0, static_cast<uint32_t>(order_.size()), search);
  std::sort_heap(search.heap.begin(), search.heap.end());
  return std::move(search.heap);
}

}  // namespace strandcast
