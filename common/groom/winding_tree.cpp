#include "common/groom/winding_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>

namespace strandcast {
namespace {

constexpr uint32_t kLeafTriangles = 4;
/// Distance in radii of a node beyond which it is a dipole. The paper recommends 2 with higher orders.
constexpr double kFarRadii = 2.3;

glm::dvec3 middle_of(const Triangle& triangle) {
  return (triangle[0] + triangle[1] + triangle[2]) / 3.0;
}

/// Of a triangle, over the half of it (van Oosterom and Strackee 1983, equation 8).
double half_solid_angle(const Triangle& triangle, const glm::dvec3& point) {
  const glm::dvec3 a = triangle[0] - point, b = triangle[1] - point, c = triangle[2] - point;
  const double la = glm::length(a), lb = glm::length(b), lc = glm::length(c);
  return std::atan2(glm::dot(a, glm::cross(b, c)),
                    la * lb * lc + glm::dot(a, b) * lc + glm::dot(b, c) * la + glm::dot(c, a) * lb);
}

}  // namespace

WindingTree::WindingTree(const std::vector<Triangle>& triangles) : triangles_(triangles) {
  nodes_.reserve(triangles.size());
  build(0, static_cast<uint32_t>(triangles_.size()));
}

uint32_t WindingTree::build(uint32_t begin, uint32_t end) {
  const auto number = static_cast<uint32_t>(nodes_.size());
  Node node{.begin = begin, .end = end};
  glm::dvec3 low(std::numeric_limits<double>::infinity()), high = -low;
  double weight = 0.0;
  for (uint32_t i = begin; i < end; ++i) {
    const auto& [a, b, c] = triangles_[i];
    const glm::dvec3 area = 0.5 * glm::cross(b - a, c - a);
    node.area += area;
    weight += glm::length(area);
    node.center += glm::length(area) * middle_of(triangles_[i]);
    low = glm::min(low, middle_of(triangles_[i]));
    high = glm::max(high, middle_of(triangles_[i]));
  }
  node.center /= weight;
  double radius_squared = 0.0;
  for (uint32_t i = begin; i < end; ++i)
    for (const glm::dvec3& corner : triangles_[i])
      radius_squared = std::max(radius_squared, glm::dot(corner - node.center, corner - node.center));
  node.far_squared = kFarRadii * kFarRadii * radius_squared;
  nodes_.push_back(node);
  if (end - begin <= kLeafTriangles) return number;

  const glm::dvec3 size = high - low;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  // Ties are broken by the corners, so that equal middles do not depend on the order that was found.
  const auto key = [axis](const Triangle& t) {
    return std::tuple(middle_of(t)[axis], t[0].x, t[0].y, t[0].z, t[1].x, t[1].y, t[1].z, t[2].x, t[2].y,
                      t[2].z);
  };
  const uint32_t half = (begin + end) / 2;
  std::sort(triangles_.begin() + begin, triangles_.begin() + end,
            [&](const Triangle& a, const Triangle& b) { return key(a) < key(b); });
  build(begin, half);
  const uint32_t right = build(half, end);
  nodes_[number].right = right;
  return number;
}

double WindingTree::winding_number(const glm::dvec3& point) const {
  double half_angle = 0.0;
  std::array<uint32_t, 64> open{};
  size_t open_count = 0;
  open[open_count++] = 0;
  while (open_count > 0) {
    const uint32_t number = open[--open_count];
    const Node& node = nodes_[number];
    const glm::dvec3 away = node.center - point;
    const double squared = glm::dot(away, away);
    if (squared > node.far_squared) {
      half_angle += 0.5 * glm::dot(away, node.area) / (squared * std::sqrt(squared));
    } else if (node.right == 0) {
      for (uint32_t i = node.begin; i < node.end; ++i) half_angle += half_solid_angle(triangles_[i], point);
    } else {
      open[open_count++] = node.right;
      open[open_count++] = number + 1;
    }
  }
  return half_angle / (2.0 * std::numbers::pi);
}

}  // namespace strandcast
