// How roots lie beside each other: the triangles that followers are drawn in, and the order of
// level-of-detail prefixes.
#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/hash.h"
#include "common/groom/groom.h"
#include "common/groom/head_fit.h"
#include "common/groom/progressive_order.h"
#include "common/math/point_tree.h"

namespace strandcast {
namespace {

constexpr uint32_t kNeighbourCount = 14;  // candidates for the star of a root; a Delaunay star has 6
constexpr uint32_t kSpacingRank = 6;      // local spacing = distance to this neighbour
constexpr uint32_t kStarVotes = 2;        // of the three corners
constexpr float kMaxEdgeInSpacings = 1.6f;
constexpr float kJitterInSpacings = 1e-3f;  // breaks ties of regular root grids the same way in every star
constexpr uint32_t kOrderSeed = 0;

using Triple = std::array<uint32_t, 3>;

/// One strand per distinct root position (the lowest index), ascending.
std::vector<uint32_t> distinct_roots(const std::vector<glm::vec3>& roots) {
  std::vector<uint32_t> order(roots.size());
  for (uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  const auto key = [&](uint32_t i) { return std::array{roots[i].x, roots[i].y, roots[i].z}; };
  std::sort(order.begin(), order.end(),
            [&](uint32_t a, uint32_t b) { return key(a) != key(b) ? key(a) < key(b) : a < b; });
  order.erase(
      std::unique(order.begin(), order.end(), [&](uint32_t a, uint32_t b) { return key(a) == key(b); }),
      order.end());
  std::sort(order.begin(), order.end());
  return order;
}

struct Plane {
  glm::dvec3 x_axis, y_axis;
};

/// Plane of best fit through the offsets: B = trace(C) I - C has the plane's normal as its dominant
/// eigenvector, which repeated squaring brings out. Collinear offsets give any plane that holds their line.
Plane fit_plane(const std::vector<glm::dvec3>& offsets) {
  constexpr int kSquarings = 8;
  glm::dmat3 covariance(0.0);
  for (const glm::dvec3& offset : offsets) covariance += glm::outerProduct(offset, offset);
  const double trace = covariance[0][0] + covariance[1][1] + covariance[2][2];
  glm::dmat3 power = glm::dmat3(trace) - covariance;
  for (int i = 0; i < kSquarings; ++i) {
    const double scale = std::abs(power[0][0]) + std::abs(power[1][1]) + std::abs(power[2][2]);
    if (!(scale > 0.0)) break;
    power = power * (1.0 / scale);
    power = power * power;
  }
  glm::dvec3 normal = power[0];
  for (int column = 1; column < 3; ++column) {
    if (glm::dot(power[column], power[column]) > glm::dot(normal, normal)) normal = power[column];
  }
  normal = glm::dot(normal, normal) > 0.0 ? glm::normalize(normal) : glm::dvec3(0.0, 1.0, 0.0);
  const glm::dvec3 aside = std::abs(normal.x) < 0.6 ? glm::dvec3(1.0, 0.0, 0.0) : glm::dvec3(0.0, 1.0, 0.0);
  const glm::dvec3 x_axis = glm::normalize(glm::cross(aside, normal));
  return {x_axis, glm::cross(normal, x_axis)};
}

struct Inverted {
  glm::dvec2 point;
  uint32_t index;
};

double cross(const glm::dvec2& a, const glm::dvec2& b) {
  return a.x * b.y - a.y * b.x;
}

/// Convex hull, counter-clockwise, by the monotone chain.
std::vector<Inverted> convex_hull(std::vector<Inverted> points) {
  std::sort(points.begin(), points.end(), [](const Inverted& a, const Inverted& b) {
    return a.point.x != b.point.x ? a.point.x < b.point.x : a.point.y < b.point.y;
  });
  std::vector<Inverted> hull;
  const auto add = [&](const Inverted& next, size_t keep) {
    while (hull.size() >= keep + 2 &&
           cross(hull.back().point - hull[hull.size() - 2].point, next.point - hull.back().point) <= 0.0) {
      hull.pop_back();
    }
    hull.push_back(next);
  };
  for (const Inverted& next : points) add(next, 0);
  const size_t lower = hull.size();
  for (size_t i = points.size(); i-- > 0;) {
    if (i + 1 < points.size()) add(points[i], lower - 1);
  }
  if (hull.size() > 1) hull.pop_back();
  return hull;
}

class StarBuilder {
 public:
  explicit StarBuilder(const std::vector<glm::vec3>& points)
      : points_(points), tree_(points), spacing_(points.size()) {}

  /// Delaunay triangles around one point among its nearest neighbours, in their plane of best fit: a circle
  /// through the point turns into a line under inversion about it, so the triangles are the hull edges of the
  /// inverted neighbours.
  void append_star(uint32_t center, std::vector<Triple>& triples) {
    const auto neighbours = tree_.nearest(points_[center], kNeighbourCount + 1);
    if (neighbours.size() < 3) return;
    spacing_[center] =
        std::sqrt(neighbours[std::min<size_t>(kSpacingRank, neighbours.size() - 1)].distance_squared);
    std::vector<glm::dvec3> offsets;
    std::vector<uint32_t> index;
    for (const auto& neighbour : neighbours) {
      if (neighbour.index == center) continue;
      offsets.push_back(jittered(neighbour.index) - jittered(center));
      index.push_back(neighbour.index);
    }
    const Plane plane = fit_plane(offsets);
    std::vector<Inverted> inverted;
    for (size_t i = 0; i < offsets.size(); ++i) {
      const glm::dvec2 flat(glm::dot(offsets[i], plane.x_axis), glm::dot(offsets[i], plane.y_axis));
      const double squared = glm::dot(flat, flat);
      if (squared > 0.0) inverted.push_back({flat / squared, index[i]});
    }
    const std::vector<Inverted> hull = convex_hull(std::move(inverted));
    for (size_t i = 0; i < hull.size() && hull.size() > 1; ++i) {
      const Inverted& a = hull[i];
      const Inverted& b = hull[(i + 1) % hull.size()];
      if (cross(a.point, b.point) <= 0.0) continue;  // the point itself lies on the edge of the set
      Triple triple = {center, a.index, b.index};
      std::sort(triple.begin(), triple.end());
      triples.push_back(triple);
    }
  }

  bool is_local(const Triple& triple) const {
    const float spacing = std::min({spacing_[triple[0]], spacing_[triple[1]], spacing_[triple[2]]});
    for (int i = 0; i < 3; ++i) {
      const float edge = glm::distance(points_[triple[i]], points_[triple[(i + 1) % 3]]);
      if (edge > kMaxEdgeInSpacings * spacing) return false;
    }
    return true;
  }

 private:
  /// Returns a point moved by about a thousandth of the distance to its nearest neighbour, alike in every
  /// star.
  glm::dvec3 jittered(uint32_t index) {
    if (jitter_m_.empty()) make_jitter();
    const uint32_t hash = mix_u32(index + 1);
    const glm::dvec3 unit(unit_float(hash), unit_float(mix_u32(hash)), unit_float(mix_u32(hash + 1)));
    return glm::dvec3(points_[index]) + (unit - 0.5) * jitter_m_[index];
  }

  void make_jitter() {
    jitter_m_.resize(points_.size());
    for (size_t i = 0; i < points_.size(); ++i) {
      jitter_m_[i] = kJitterInSpacings * std::sqrt(tree_.nearest(points_[i], 2).back().distance_squared);
    }
  }

  const std::vector<glm::vec3>& points_;
  PointTree tree_;
  std::vector<float> spacing_;
  std::vector<double> jitter_m_;
};

}  // namespace

std::vector<RootTriangle> make_root_triangles(const Groom& groom) {
  const std::vector<glm::vec3> roots = roots_of(groom);
  const std::vector<uint32_t> strands = distinct_roots(roots);
  std::vector<glm::vec3> points(strands.size());
  for (size_t i = 0; i < strands.size(); ++i) points[i] = roots[strands[i]];
  if (points.size() < 3) return {};

  StarBuilder builder(points);
  std::vector<Triple> triples;
  triples.reserve(points.size() * 6);
  for (uint32_t i = 0; i < points.size(); ++i) builder.append_star(i, triples);
  std::sort(triples.begin(), triples.end());

  std::vector<RootTriangle> triangles;
  for (auto first = triples.begin(); first != triples.end();) {
    const auto last =
        std::find_if(first, triples.end(), [&](const Triple& triple) { return triple != *first; });
    if (last - first >= kStarVotes && builder.is_local(*first))
      triangles.emplace_back(strands[(*first)[0]], strands[(*first)[1]], strands[(*first)[2]]);
    first = last;
  }
  return triangles;
}

std::vector<uint32_t> make_prefix_order(const Groom& groom) {
  const std::vector<glm::vec3> roots = roots_of(groom);
  return make_progressive_order(roots, groom.strand_count(), kOrderSeed);
}

}  // namespace strandcast
