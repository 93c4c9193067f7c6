#include "common/groom/mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace strandcast {
namespace {

/// Polar angle from the crown axis down to the hairline, by azimuth (0 = face, pi = neck).
double hairline_rad(double azimuth_rad) {
  constexpr double kMean_rad = 1.60, kFrontToBack_rad = -0.15;  // face 1.45, above the ears 1.60, neck 1.75
  return kMean_rad + kFrontToBack_rad * std::cos(azimuth_rad);
}

/// The crown axis leans back, so that the cap reaches down the neck and leaves the forehead free.
glm::dvec3 lean_back(const glm::dvec3& v) {
  constexpr double kLean_rad = 0.47;
  const double c = std::cos(kLean_rad), s = std::sin(kLean_rad);
  return {v.x, c * v.y + s * v.z, c * v.z - s * v.y};
}

struct Ring {
  uint32_t first = 0;  // vertex
  uint32_t count = 0;
};

/// Triangles between two closed rings whose vertices start at the same azimuth; `inner` may be a single
/// vertex.
void stitch_rings(const Ring& inner, const Ring& outer, std::vector<glm::uvec3>& triangles) {
  uint32_t i = 0, o = 0;
  while (i < inner.count || o < outer.count) {
    const uint32_t inner_here = inner.first + i % inner.count, outer_here = outer.first + o % outer.count;
    // Steps on the ring that lags behind in azimuth.
    const bool is_outer_step = inner.count == 1 || i == inner.count ||
                               (o < outer.count && uint64_t{o} * inner.count <= uint64_t{i} * outer.count);
    if (is_outer_step) {
      triangles.emplace_back(inner_here, outer_here, outer.first + (o + 1) % outer.count);
      ++o;
    } else {
      triangles.emplace_back(inner_here, outer_here, inner.first + (i + 1) % inner.count);
      ++i;
    }
    if (inner.count == 1 && o == outer.count) break;
  }
}

FittedSphere bounding_sphere(const std::vector<glm::vec3>& points_m) {
  FittedSphere sphere;
  if (points_m.empty()) return sphere;
  glm::vec3 low = points_m.front(), high = low;
  for (const glm::vec3& point : points_m) {
    low = glm::min(low, point);
    high = glm::max(high, point);
  }
  sphere.center_m = 0.5f * (low + high);
  sphere.radius_m = 0.0f;
  for (const glm::vec3& point : points_m) {
    sphere.radius_m = std::max(sphere.radius_m, glm::distance(point, sphere.center_m));
  }
  return sphere;
}

using Row = std::array<double, 5>;  // four coefficients and the right-hand side

/// Gauss elimination with row pivoting; false when the system is nearly singular.
bool solve(std::array<Row, 4>& rows, std::array<double, 4>& solution) {
  constexpr double kMinPivot = 1e-9;  // the data is scaled to about 1
  for (size_t column = 0; column < 4; ++column) {
    size_t best = column;
    for (size_t row = column + 1; row < 4; ++row) {
      if (std::abs(rows[row][column]) > std::abs(rows[best][column])) best = row;
    }
    std::swap(rows[column], rows[best]);
    if (!(std::abs(rows[column][column]) > kMinPivot)) return false;
    for (size_t row = column + 1; row < 4; ++row) {
      const double factor = rows[row][column] / rows[column][column];
      for (size_t k = column; k < 5; ++k) rows[row][k] -= factor * rows[column][k];
    }
  }
  for (size_t row = 4; row-- > 0;) {
    solution[row] = rows[row][4];
    for (size_t k = row + 1; k < 4; ++k) solution[row] -= rows[row][k] * solution[k];
    solution[row] /= rows[row][row];
  }
  return true;
}

}  // namespace

Mesh make_scalp_cap(const glm::vec3& center_m, float radius_m, uint32_t vertex_target) {
  // Area of a cap down to polar angle t is 2 pi (1 - cos t); a vertex of a triangle lattice of spacing d
  // covers d^2 sqrt(3)/2.
  const double mean_polar_rad = hairline_rad(std::numbers::pi / 2);
  const double area = 2.0 * std::numbers::pi * (1.0 - std::cos(mean_polar_rad));
  const double spacing = std::sqrt(area / std::max(vertex_target, 7u) / (std::sqrt(3.0) / 2.0));
  const auto ring_total =
      std::max(1u, static_cast<uint32_t>(mean_polar_rad / (spacing * std::sqrt(3.0) / 2.0) + 0.5));
  Mesh mesh;
  const auto add_vertex = [&](double polar_rad, double azimuth_rad) {
    const glm::dvec3 upright(std::sin(polar_rad) * std::sin(azimuth_rad), std::cos(polar_rad),
                             std::sin(polar_rad) * std::cos(azimuth_rad));
    const glm::dvec3 normal = lean_back(upright);
    mesh.normal.emplace_back(normal);
    mesh.position_m.emplace_back(glm::dvec3(center_m) + static_cast<double>(radius_m) * normal);
  };
  add_vertex(0.0, 0.0);
  Ring inner{0, 1};
  for (uint32_t ring = 1; ring <= ring_total; ++ring) {
    const double part = static_cast<double>(ring) / ring_total;
    const double around = 2.0 * std::numbers::pi * std::sin(part * mean_polar_rad);
    const Ring outer{static_cast<uint32_t>(mesh.position_m.size()),
                     std::max(5u, static_cast<uint32_t>(around / spacing + 0.5))};
    for (uint32_t i = 0; i < outer.count; ++i) {
      const double azimuth_rad = 2.0 * std::numbers::pi * i / outer.count;
      add_vertex(part * hairline_rad(azimuth_rad), azimuth_rad);
    }
    stitch_rings(inner, outer, mesh.triangle);
    inner = outer;
  }
  return mesh;
}

FittedSphere fit_sphere(const std::vector<glm::vec3>& points_m) {
  const FittedSphere bounding = bounding_sphere(points_m);
  if (points_m.size() < 4 || !(bounding.radius_m > 0.0f)) return bounding;
  // |p|^2 = 2 p.c + (r^2 - |c|^2) is linear in c and the bracket; points are centred and scaled first.
  std::array<Row, 4> rows{};
  for (const glm::vec3& point : points_m) {
    const glm::dvec3 p =
        (glm::dvec3(point) - glm::dvec3(bounding.center_m)) / static_cast<double>(bounding.radius_m);
    const std::array<double, 4> a = {2.0 * p.x, 2.0 * p.y, 2.0 * p.z, 1.0};
    for (size_t row = 0; row < 4; ++row) {
      for (size_t column = 0; column < 4; ++column) rows[row][column] += a[row] * a[column];
      rows[row][4] += a[row] * glm::dot(p, p);
    }
  }
  for (Row& row : rows) {
    for (double& value : row) value /= static_cast<double>(points_m.size());
  }
  std::array<double, 4> solution{};
  if (!solve(rows, solution)) return bounding;
  const glm::dvec3 center(solution[0], solution[1], solution[2]);
  const double radius_squared = solution[3] + glm::dot(center, center);
  if (!(radius_squared > 0.0) || !std::isfinite(radius_squared)) return bounding;
  FittedSphere fitted;
  fitted.center_m =
      glm::vec3(glm::dvec3(bounding.center_m) + static_cast<double>(bounding.radius_m) * center);
  fitted.radius_m = static_cast<float>(std::sqrt(radius_squared) * static_cast<double>(bounding.radius_m));
  return fitted;
}

}  // namespace strandcast
