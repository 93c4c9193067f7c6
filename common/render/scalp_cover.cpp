#include "common/render/scalp_cover.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>

#include "common/base/quantile.h"
#include "common/math/point_tree.h"

namespace strandcast {
namespace {

// What is between roots is between some of this many nearest ones.
constexpr uint32_t kNearestRoots = 14;
// Roots that are further apart than so many spacings have bare skin between them.
constexpr float kMostSpacings = 2.0f;
// Where roots are far apart the tint fades over this share of their spacing: more gently than the head's mesh
// steps.
constexpr float kFadeSpacings = 0.4f;
// Up to this share of the reach skin beside the area is covered as that between the roots.
constexpr float kFullReach = 0.2f;
// So far off a triangle skin still belongs to it: of the reach, and of the triangle's edges.
constexpr float kOffReach = 0.5f, kOffEdge = 0.25f;

/// Distance of a point to the segment from a to b, squared.
float squared_to_segment(const glm::vec3& point, const glm::vec3& a, const glm::vec3& b) {
  const glm::vec3 along = b - a;
  const float squared = glm::dot(along, along);
  const float part = squared > 0.0f ? std::clamp(glm::dot(point - a, along) / squared, 0.0f, 1.0f) : 0.0f;
  const glm::vec3 off = point - (a + part * along);
  return glm::dot(off, off);
}

/// From a point to a triangle, squared. Skin bulges between roots that are far apart, and may lie off those
/// that are not: up to `off_m` above or below counts as on it.
float squared_to_triangle(const glm::vec3& point, const glm::vec3& a, const glm::vec3& b, const glm::vec3& c,
                          float off_m) {
  const glm::vec3 cross = glm::cross(b - a, c - a);
  const float length = glm::length(cross);
  if (!(length > 0.0f)) return squared_to_segment(point, a, b);
  const glm::vec3 normal = cross / length;
  const float height = glm::dot(point - a, normal);
  const glm::vec3 below = point - height * normal;
  const float off = std::max(0.0f, std::abs(height) - off_m);
  const bool is_inside = glm::dot(glm::cross(b - a, below - a), normal) >= 0.0f &&
                         glm::dot(glm::cross(c - b, below - b), normal) >= 0.0f &&
                         glm::dot(glm::cross(a - c, below - c), normal) >= 0.0f;
  const float beside_squared =
      is_inside ? 0.0f
                : std::min({squared_to_segment(below, a, b), squared_to_segment(below, b, c),
                            squared_to_segment(below, c, a)});
  return beside_squared + off * off;
}

/// How far roots usually are apart, so that six others are nearer: the median over some of them.
float spacing_of(const PointTree& tree, std::span<const glm::vec3> root_m) {
  constexpr uint32_t kSamples = 256, kRank = 6;
  std::vector<float> spacing_m;
  for (size_t i = 0; i < root_m.size(); i += root_m.size() / kSamples + 1)
    spacing_m.push_back(std::sqrt(tree.nearest(root_m[i], kRank + 1).back().distance_squared));
  return median(std::move(spacing_m));
}

/// The area between roots: all triangles of roots that are no further apart than neighbours are.
class RootArea {
 public:
  RootArea(std::span<const glm::vec3> root_m, float reach_m) : root_m_(root_m), tree_(root_m) {
    const float spacing_m = spacing_of(tree_, root_m);
    most_m_ = kMostSpacings * spacing_m;
    reach_m_ = std::max(reach_m, kFadeSpacings * spacing_m);
  }

  /// 1 in the area, falling smoothly to 0 beside it.
  float cover_at(const glm::vec3& point_m) const {
    const float left = (1.0f - distance_m(point_m) / reach_m_) / (1.0f - kFullReach);
    return left > 0.0f ? std::min(left * left, 1.0f) : 0.0f;  // false for NaN
  }

 private:
  /// From a point to the area.
  float distance_m(const glm::vec3& point_m) const {
    const std::vector<PointTree::Neighbour> near = tree_.nearest(point_m, kNearestRoots);
    float squared = near.front().distance_squared;
    // Nothing is nearer than its roots but by what is between them.
    if (std::sqrt(squared) > most_m_ + reach_m_) return std::sqrt(squared);
    // Between each two of them, once; most triangles have an edge that is too long.
    std::array<std::array<float, kNearestRoots>, kNearestRoots> apart_m{};
    for (size_t i = 0; i < near.size(); ++i)
      for (size_t j = i + 1; j < near.size(); ++j)
        apart_m[i][j] = glm::distance(root_m_[near[i].index], root_m_[near[j].index]);
    for (size_t i = 0; i < near.size(); ++i)
      for (size_t j = i + 1; j < near.size(); ++j) {
        if (!(apart_m[i][j] <= most_m_)) continue;
        for (size_t k = j + 1; k < near.size() && squared > 0.0f; ++k) {
          const float edge_m = std::max({apart_m[i][j], apart_m[j][k], apart_m[i][k]});
          if (!(edge_m <= most_m_)) continue;
          const float off_m = std::max(kOffReach * reach_m_, kOffEdge * edge_m);
          squared =
              std::min(squared, squared_to_triangle(point_m, root_m_[near[i].index], root_m_[near[j].index],
                                                    root_m_[near[k].index], off_m));
        }
      }
    return std::sqrt(squared);
  }

  std::span<const glm::vec3> root_m_;
  PointTree tree_;
  float most_m_ = 0.0f;   // between corners
  float reach_m_ = 0.0f;  // over which it fades
};

}  // namespace

std::vector<float> scalp_cover(const SceneAsset& asset, float reach_m) {
  std::vector<float> cover(asset.head.position_m.size(), 0.0f);
  if (cover.empty() || asset.strand_count == 0 || !(reach_m > 0.0f)) return cover;
  const RootArea area({asset.rest_position_m.data(), asset.strand_count}, reach_m);
  for (size_t i = 0; i < cover.size(); ++i) cover[i] = area.cover_at(asset.head.position_m[i]);
  return cover;
}

}  // namespace strandcast
