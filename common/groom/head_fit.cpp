#include "common/groom/head_fit.h"

#include <algorithm>
#include <array>

namespace strandcast {
namespace {

/// Parts of the roots, from the top, that are tried as those of the head; fewer than kMinFittedRoots say
/// nothing.
constexpr std::array kUpperParts = {1.0, 0.75, 0.5, 0.35, 0.25};
constexpr size_t kMinFittedRoots = 16;

float extent_m(const std::vector<glm::vec3>& points_m) {
  glm::vec3 low = points_m.front(), high = points_m.front();
  for (const glm::vec3& point : points_m) {
    low = glm::min(low, point);
    high = glm::max(high, point);
  }
  return glm::length(high - low);
}

}  // namespace

std::vector<glm::vec3> roots_of(const Groom& groom) {
  std::vector<glm::vec3> roots(groom.strand_count());
  for (uint32_t strand = 0; strand < groom.strand_count(); ++strand)
    roots[strand] = groom.rest_position_m[groom.offset[strand]];
  return roots;
}

FittedSphere fit_head_sphere(const Groom& groom) {
  std::vector<glm::vec3> roots = roots_of(groom);
  const FittedSphere of_all = fit_sphere(roots);
  std::sort(roots.begin(), roots.end(), [](const glm::vec3& a, const glm::vec3& b) { return a.y > b.y; });
  for (const double part : kUpperParts) {
    const auto count = static_cast<size_t>(part * static_cast<double>(groom.strand_count()));
    if (count < kMinFittedRoots) break;
    roots.resize(count);
    const FittedSphere fitted = fit_sphere(roots);
    if (extent_m(roots) >= 2.0f * fitted.radius_m) return fitted;
  }
  return of_all;
}

}  // namespace strandcast
