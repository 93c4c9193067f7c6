#include "common/groom/head_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "common/base/quantile.h"

namespace strandcast {
namespace {

/// Parts of the roots, from the top, that are tried as those of the head; fewer than kMinFittedRoots say
/// nothing.
constexpr std::array kUpperParts = {1.0, 0.75, 0.5, 0.35, 0.25};
constexpr size_t kMinFittedRoots = 16;

/// A head that roots say nothing of, and the sizes that a fitted one may have.
constexpr float kUsualRadiusM = 0.095f, kSmallestRadiusM = 0.06f, kLargestRadiusM = 0.14f;
/// Strands that grow in all directions, less than this share together, say nothing of which side they stand
/// on.
constexpr double kMinTogether = 0.3;

/// Mean direction in which strands leave their roots, at most 1 long.
glm::dvec3 growth_direction(const Groom& groom) {
  glm::dvec3 sum(0.0);
  double count = 0.0;
  for (uint32_t strand = 0; strand < groom.strand_count(); ++strand) {
    const uint32_t root = groom.offset[strand];
    const glm::dvec3 out =
        glm::dvec3(groom.rest_position_m[root + 1]) - glm::dvec3(groom.rest_position_m[root]);
    const double length = glm::length(out);
    if (!std::isfinite(length) || !(length > 0.0)) continue;
    sum += out / length;
    count += 1.0;
  }
  return count > 0.0 ? sum / count : sum;
}

/// Whether roots stand all around the sphere. Hair leaves 55 degrees and more about face or neck, beside a
/// beard 15 of the face; fur of a ball no more than its roots are apart.
bool is_covered(const FittedSphere& sphere, const std::vector<glm::vec3>& roots) {
  constexpr double kSpacings = 1.5, kGoldenAngleRad = 2.399963;
  constexpr int kPlaces = 128, kMostBare = 1;
  const double spacing_rad = std::sqrt(4.0 * std::numbers::pi / static_cast<double>(roots.size()));
  const double near_cos =
      std::cos(std::clamp(kSpacings * spacing_rad, glm::radians(4.0), glm::radians(35.0)));
  int bare_count = 0;
  for (int i = 0; i < kPlaces; ++i) {
    const double up = 1.0 - (2.0 * i + 1.0) / kPlaces, level = std::sqrt(1.0 - up * up);
    const double around = kGoldenAngleRad * i;
    const glm::vec3 place(glm::dvec3(level * std::sin(around), up, level * std::cos(around)));
    const bool has_root = std::any_of(roots.begin(), roots.end(), [&](const glm::vec3& root) {
      const glm::vec3 out = root - sphere.center_m;
      return static_cast<double>(glm::dot(place, out)) > near_cos * static_cast<double>(glm::length(out));
    });
    bare_count += has_root ? 0 : 1;
    if (bare_count > kMostBare) return false;
  }
  return true;
}

/// Heads have 93 % and more of their roots there, bodies with limbs 50 to 70 %, discs 66.
bool are_near(const FittedSphere& sphere, const std::vector<glm::vec3>& roots) {
  constexpr float kNearest = 0.7f, kFurthest = 1.35f;
  constexpr size_t kOfTen = 8;
  const auto near_count = std::count_if(roots.begin(), roots.end(), [&](const glm::vec3& root) {
    const float radii = glm::distance(root, sphere.center_m) / sphere.radius_m;
    return radii > kNearest && radii < kFurthest;
  });
  return 10 * static_cast<size_t>(near_count) >= kOfTen * roots.size();
}

/// Whether all roots lie below the middle of a face that they reach around: +Y is up. Hair of a head covers
/// its top, and a wreath of hair reaches up to its middle.
bool are_on_jaw(const FittedSphere& face, const std::vector<glm::vec3>& roots) {
  constexpr double kMost = 0.98;
  constexpr float kHighest = 0.15f, kHalf = -0.3f, kNearest = 0.6f, kFurthest = 1.6f;  // radii
  if (!(extent_of(roots) >= face.radius_m)) return false;
  size_t low_count = 0, near_count = 0;
  std::vector<float> heights;
  for (const glm::vec3& root : roots) {
    const glm::vec3 out = (root - face.center_m) / face.radius_m;
    if (!std::isfinite(out.x + out.y + out.z)) return false;
    heights.push_back(out.y);
    low_count += out.y < kHighest ? 1 : 0;
    near_count += glm::length(out) > kNearest && glm::length(out) < kFurthest ? 1 : 0;
  }
  const auto most = static_cast<size_t>(kMost * static_cast<double>(roots.size()));
  return low_count >= most && near_count >= most && median(std::move(heights)) < kHalf;
}

}  // namespace

std::vector<glm::vec3> roots_of(const Groom& groom) {
  std::vector<glm::vec3> roots(groom.strand_count());
  for (uint32_t strand = 0; strand < groom.strand_count(); ++strand)
    roots[strand] = groom.rest_position_m[groom.offset[strand]];
  return roots;
}

glm::vec3 box_size_of(const std::vector<glm::vec3>& points) {
  glm::vec3 low = points.front(), high = points.front();
  for (const glm::vec3& point : points) {
    low = glm::min(low, point);
    high = glm::max(high, point);
  }
  return high - low;
}

float extent_of(const std::vector<glm::vec3>& points) {
  return glm::length(box_size_of(points));
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
    if (extent_of(roots) >= 2.0f * fitted.radius_m) return fitted;
  }
  return of_all;
}

bool are_flat(const std::vector<glm::vec3>& points) {
  constexpr double kFlat = 0.05;  // 1 for what is as wide on all sides; a disc a tenth as thick has 0.03
  glm::dvec3 middle(0.0);
  for (const glm::vec3& point : points) middle += glm::dvec3(point) / static_cast<double>(points.size());
  glm::dmat3 spread(0.0);
  for (const glm::vec3& point : points)
    spread += glm::outerProduct(glm::dvec3(point) - middle, glm::dvec3(point) - middle);
  const double mean = (spread[0][0] + spread[1][1] + spread[2][2]) / 3.0;
  return !(glm::determinant(spread) > kFlat * mean * mean * mean);
}

bool are_on_a_disc(const std::vector<glm::vec3>& roots) {
  return roots.size() >= kMinFittedRoots && are_flat(roots) && !are_near(fit_sphere(roots), roots);
}

HairPlace hair_place(const Groom& groom) {
  const std::vector<glm::vec3> roots = roots_of(groom);
  if (roots.size() < kMinFittedRoots) return HairPlace::Head;
  const FittedSphere fitted = fit_sphere(roots);
  if (are_on_jaw(fitted, roots)) return HairPlace::Jaw;
  // Hair of a disc grows to one side of it; fur of a slender body, which is as flat, to all.
  const bool is_disc = are_on_a_disc(roots) && glm::length(growth_direction(groom)) >= kMinTogether;
  if (!(extent_of(roots) >= 2.0f * fitted.radius_m) || is_disc) return HairPlace::Head;
  return are_near(fitted, roots) && !is_covered(fitted, roots) ? HairPlace::Head : HairPlace::Body;
}

bool is_hair_of_head(const Groom& groom) {
  return hair_place(groom) == HairPlace::Head;
}

bool is_piece(const Groom& groom) {
  constexpr double kMost = 0.98;
  constexpr float kTop = 0.55f;  // of the way up to the crown
  const std::vector<glm::vec3> roots = roots_of(groom);
  if (roots.size() < kMinFittedRoots) return false;
  const FittedSphere fitted = fit_sphere(roots);
  std::vector<glm::vec3> out;
  glm::vec3 middle(0.0f);
  for (const glm::vec3& root : roots) {
    out.push_back(glm::normalize(root - fitted.center_m));
    middle += glm::vec3(out.back().x, 0.0f, out.back().z);
  }
  const auto count = std::count_if(out.begin(), out.end(), [&](const glm::vec3& direction) {
    return glm::dot(direction, middle) > 0.0f && direction.y < kTop;
  });
  return static_cast<double>(count) >= kMost * static_cast<double>(roots.size());
}

float covered_head_radius(const Groom& groom) {
  constexpr size_t kMinCoveredRoots = 64;
  const std::vector<glm::vec3> roots = roots_of(groom);
  if (roots.size() < kMinCoveredRoots || are_on_a_disc(roots) || !is_hair_of_head(groom)) return 0.0f;
  const FittedSphere fitted = fit_sphere(roots);
  return std::isfinite(fitted.radius_m) && extent_of(roots) >= 2.0f * fitted.radius_m ? fitted.radius_m
                                                                                      : 0.0f;
}

FittedSphere fit_head(const Groom& groom) {
  const FittedSphere fitted = fit_head_sphere(groom);
  if (groom.strand_count() >= kMinFittedRoots && fitted.radius_m >= kSmallestRadiusM &&
      fitted.radius_m <= kLargestRadiusM)
    return fitted;
  glm::dvec3 middle(0.0);
  for (const glm::vec3& root : roots_of(groom))
    middle += glm::dvec3(root) / static_cast<double>(groom.strand_count());
  const glm::dvec3 growth = growth_direction(groom);
  const double together = glm::length(growth);
  const glm::dvec3 outwards = together >= kMinTogether ? growth / together : glm::dvec3(0.0, 1.0, 0.0);
  return {glm::vec3(middle - static_cast<double>(kUsualRadiusM) * outwards), kUsualRadiusM};
}

}  // namespace strandcast
