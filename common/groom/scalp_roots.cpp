#include "common/groom/scalp_roots.h"

#include <algorithm>
#include <cmath>

#include "common/base/hash.h"
#include "common/groom/progressive_order.h"

namespace strandcast {
namespace {

// Random points on offer per root; the progressive order picks those that keep their distance.
constexpr uint32_t kCandidatesPerRoot = 6;
constexpr uint32_t kMinCandidates = 512;

struct AreaTable {
  std::vector<double> up_to;  // area of the triangles up to and including each one
  double total() const { return up_to.back(); }
};

bool is_finite(const glm::vec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

Status check_mesh(const Mesh& scalp) {
  if (scalp.triangle.empty()) return make_error(ErrorCode::BadInput, "the scalp mesh has no triangles");
  if (scalp.normal.size() != scalp.position_m.size()) {
    return make_error(ErrorCode::BadInput, "the scalp mesh has {} normals for {} vertices",
                      scalp.normal.size(), scalp.position_m.size());
  }
  for (size_t i = 0; i < scalp.position_m.size(); ++i) {
    if (is_finite(scalp.position_m[i]) && is_finite(scalp.normal[i])) continue;
    return make_error(ErrorCode::BadInput, "vertex {} of the scalp mesh is not finite", i);
  }
  for (size_t i = 0; i < scalp.triangle.size(); ++i) {
    const glm::uvec3& corner = scalp.triangle[i];
    const uint32_t largest = std::max({corner.x, corner.y, corner.z});
    if (largest < scalp.position_m.size()) continue;
    return make_error(ErrorCode::BadInput, "triangle {} of the scalp mesh names vertex {} of {}", i, largest,
                      scalp.position_m.size());
  }
  return {};
}

AreaTable measure_area(const Mesh& scalp) {
  AreaTable table;
  table.up_to.reserve(scalp.triangle.size());
  double total = 0.0;
  for (const glm::uvec3& corner : scalp.triangle) {
    const glm::dvec3 a = scalp.position_m[corner.x];
    const glm::dvec3 b = scalp.position_m[corner.y];
    const glm::dvec3 c = scalp.position_m[corner.z];
    total += 0.5 * glm::length(glm::cross(b - a, c - a));
    table.up_to.push_back(total);
  }
  return table;
}

/// The point of a triangle at two uniform numbers, with the interpolated normal (or the triangle's own).
ScalpRoot point_in_triangle(const Mesh& scalp, const glm::uvec3& corner, float u, float v) {
  // Folds the unit square onto the triangle.
  if (u + v > 1.0f) {
    u = 1.0f - u;
    v = 1.0f - v;
  }
  const glm::vec3 weight(1.0f - u - v, u, v);
  const glm::vec3 &a = scalp.position_m[corner.x], &b = scalp.position_m[corner.y],
                  &c = scalp.position_m[corner.z];
  ScalpRoot root;
  root.position_m = weight.x * a + weight.y * b + weight.z * c;
  glm::vec3 normal = weight.x * scalp.normal[corner.x] + weight.y * scalp.normal[corner.y] +
                     weight.z * scalp.normal[corner.z];
  if (!(glm::dot(normal, normal) > 1e-6f)) normal = glm::cross(b - a, c - a);
  if (glm::dot(normal, normal) > 0.0f) root.normal = glm::normalize(normal);
  return root;
}

/// Candidates spread by area: evenly spaced along the summed area, random inside of the triangle.
std::vector<ScalpRoot> offer_candidates(const Mesh& scalp, const AreaTable& area, uint32_t count,
                                        uint32_t seed) {
  std::vector<ScalpRoot> candidates(count);
  const uint32_t salt = mix_u32(seed ^ 0x5ca1ab1eu);
  size_t triangle = 0;
  for (uint32_t i = 0; i < count; ++i) {
    const uint32_t hash = mix_u32(i ^ salt);
    const double target = (i + unit_float(hash)) / static_cast<double>(count) * area.total();
    while (triangle + 1 < area.up_to.size() && area.up_to[triangle] < target) ++triangle;
    const uint32_t hash_u = mix_u32(hash + 1), hash_v = mix_u32(hash_u + 1);
    candidates[i] =
        point_in_triangle(scalp, scalp.triangle[triangle], unit_float(hash_u), unit_float(hash_v));
  }
  return candidates;
}

/// How many times the area around a point is stretched.
float stretched(const ScalpRoot& root, const RootSpread& spread) {
  constexpr float kStepM = 1e-4f;
  const glm::vec3 aside = std::abs(root.normal.x) < 0.5f ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0);
  const glm::vec3 along = glm::normalize(glm::cross(root.normal, aside));
  const glm::vec3 across = glm::cross(along, root.normal);
  const glm::vec3 here = spread.moved(root.position_m);
  const glm::vec3 area = glm::cross(spread.moved(root.position_m + kStepM * along) - here,
                                    spread.moved(root.position_m + kStepM * across) - here);
  return glm::length(area) / (kStepM * kStepM);
}

/// More candidates where roots stand closer: as many in all places for each root.
void offer_more(const Mesh& scalp, const AreaTable& area, uint32_t seed, const RootSpread& spread,
                std::vector<ScalpRoot>& candidates) {
  const auto rounds = static_cast<uint32_t>(std::ceil(spread.most_times - 1.0f));
  const auto count = static_cast<uint32_t>(candidates.size());
  for (uint32_t round = 1; round <= rounds; ++round) {
    const uint32_t salt = mix_u32(seed ^ mix_u32(round));
    const std::vector<ScalpRoot> more = offer_candidates(scalp, area, count, salt);
    for (uint32_t i = 0; i < count; ++i) {
      const float wanted = stretched(more[i], spread) - static_cast<float>(round);
      if (wanted > unit_float(mix_u32(i ^ mix_u32(salt)))) candidates.push_back(more[i]);
    }
  }
}

}  // namespace

Result<std::vector<ScalpRoot>> spread_roots(const Mesh& scalp, uint32_t count, uint32_t seed,
                                            const RootSpread& spread) {
  RETURN_IF_ERROR(check_mesh(scalp));
  const AreaTable area = measure_area(scalp);
  if (!std::isfinite(area.total()) || area.total() <= 0.0) {
    return make_error(ErrorCode::BadInput, "the scalp mesh has the area {}", area.total());
  }
  const uint32_t offered = std::max(count * kCandidatesPerRoot, kMinCandidates);
  std::vector<ScalpRoot> candidates = offer_candidates(scalp, area, offered, seed);
  if (spread.moved) offer_more(scalp, area, seed, spread, candidates);
  std::vector<glm::vec3> points(candidates.size());
  std::transform(candidates.begin(), candidates.end(), points.begin(), [&](const ScalpRoot& root) {
    return spread.moved ? spread.moved(root.position_m) : root.position_m;
  });
  std::vector<ScalpRoot> roots;
  roots.reserve(count);
  for (const uint32_t index : make_progressive_order(points, count, seed)) roots.push_back(candidates[index]);
  return roots;
}

}  // namespace strandcast
