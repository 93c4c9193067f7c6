#include "common/groom/bust_skin.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace strandcast {
namespace {

constexpr int kSlices = 48;
/// Of the mesh's height from below: the neck is thinnest between these.
constexpr double kNeckLow = 0.2, kNeckHigh = 0.75;
/// Shoulders and head are so many times as wide as the neck, at least.
constexpr double kShoulderShare = 1.8, kHeadShare = 1.25;
/// The border between head and neck rises so much backwards: from under the chin to the nape.
constexpr double kSlope = 0.4;
/// Where a face begins, from the middle of the head forwards, and how wide a chin is; of the head's half
/// width.
constexpr double kFaceShare = 0.55, kChinShare = 0.35;
/// The neck ends where the mesh is so many times as wide.
constexpr double kNeckEnd = 1.7;
/// No neck is shorter, in the head's half width: a bend would fold it.
constexpr double kShortestNeck = 1.25;

/// Half widths of a mesh by height.
struct Slices {
  double low_m = 0.0, step_m = 0.0, middle_m = 0.0;
  std::array<double, kSlices> half_m{};

  double height_m(int slice) const { return low_m + (slice + 0.5) * step_m; }
  int at(double y_m) const { return std::clamp(static_cast<int>((y_m - low_m) / step_m), 0, kSlices - 1); }
};

Slices slices_of(const Mesh& mesh, const glm::dvec3& low, const glm::dvec3& high) {
  Slices slices{low.y, (high.y - low.y) / kSlices, 0.5 * (low.x + high.x), {}};
  // Triangles reach from slice to slice, where vertices are far apart.
  for (const glm::uvec3& corner : mesh.triangle)
    for (int k = 0; k < 3; ++k) {
      const glm::dvec3 a(mesh.position_m[corner[k]]), b(mesh.position_m[corner[(k + 1) % 3]]);
      for (int i = slices.at(std::min(a.y, b.y)); i <= slices.at(std::max(a.y, b.y)); ++i) {
        const double rise = b.y - a.y;
        const double share = rise != 0.0 ? std::clamp((slices.height_m(i) - a.y) / rise, 0.0, 1.0) : 0.0;
        const double x = a.x + share * (b.x - a.x);
        slices.half_m[static_cast<size_t>(i)] =
            std::max(slices.half_m[static_cast<size_t>(i)], std::abs(x - slices.middle_m));
      }
    }
  return slices;
}

}  // namespace

BustRig find_bust(const Mesh& mesh) {
  if (mesh.triangle.empty()) return {};
  glm::dvec3 low(mesh.position_m[mesh.triangle.front().x]), high = low;
  for (const glm::uvec3& corner : mesh.triangle)
    for (int k = 0; k < 3; ++k) {
      low = glm::min(low, glm::dvec3(mesh.position_m[corner[k]]));
      high = glm::max(high, glm::dvec3(mesh.position_m[corner[k]]));
    }
  if (!(high.y - low.y > 0.0) || !std::isfinite(high.y - low.y)) return {};
  const Slices slices = slices_of(mesh, low, high);
  const auto width = [&](int slice) { return slices.half_m[static_cast<size_t>(slice)]; };
  int neck = static_cast<int>(kNeckLow * kSlices);
  for (int i = neck; i < static_cast<int>(kNeckHigh * kSlices); ++i)
    if (width(i) < width(neck)) neck = i;
  const auto begin = slices.half_m.begin();
  const double shoulders_m = *std::max_element(begin, begin + neck + 1);
  const double head_m = *std::max_element(begin + neck, slices.half_m.end());
  if (shoulders_m < kShoulderShare * width(neck) || head_m < kHeadShare * width(neck)) return {};

  // The face's lowest place is the chin.
  const double neck_m = slices.height_m(neck);
  double back_m = high.z, front_m = low.z;
  for (const glm::vec3& point : mesh.position_m) {
    if (static_cast<double>(point.y) < neck_m + 0.5 * head_m) continue;
    back_m = std::min(back_m, static_cast<double>(point.z));
    front_m = std::max(front_m, static_cast<double>(point.z));
  }
  const double middle_z_m = back_m + head_m;
  const auto level_of = [&](const glm::dvec3& p) { return p.y + kSlope * (p.z - middle_z_m); };
  double chin_m = high.y;
  for (const glm::vec3& point : mesh.position_m) {
    const glm::dvec3 p(point);
    const bool is_face = p.z > middle_z_m + kFaceShare * head_m && p.y > neck_m - 0.1 * head_m &&
                         std::abs(p.x - slices.middle_m) < kChinShare * head_m;
    if (is_face) chin_m = std::min(chin_m, level_of(p));
  }
  if (!(front_m > middle_z_m + kFaceShare * head_m) || !(chin_m < high.y)) return {};
  int end = neck;
  while (end > 0 && width(end) < kNeckEnd * width(neck)) --end;
  const glm::dvec3 base(slices.middle_m, slices.height_m(end), middle_z_m - 0.5 * head_m);
  const double span_m = std::max(chin_m - level_of(base), kShortestNeck * head_m);

  BustRig rig;
  // Behind the middle of the head, as high as the border is there.
  const double pivot_z_m = middle_z_m - 0.14 * head_m;
  rig.pivot_m = glm::vec3(glm::dvec3(slices.middle_m, chin_m + kSlope * 0.14 * head_m, pivot_z_m));
  const double per_m = 1.0 / span_m;
  rig.share = glm::vec4(glm::dvec4(0.0, per_m, kSlope * per_m, (chin_m + kSlope * middle_z_m) * per_m));
  return rig;
}

BustSkin::BustSkin(const Mesh& rest) : rig_(find_bust(rest)) {
  if (!rig_.exists()) return;
  for (uint32_t i = 0; i < rest.position_m.size(); ++i)
    if (bust_share(rig_, glm::dvec3(rest.position_m[i])) > 0.0)
      moved_.push_back({i, rest.position_m[i], rest.normal[i]});
}

bool BustSkin::pose(const BustTurn& turn, Mesh& mesh) {
  if (turn == turn_ || moved_.empty()) return false;
  turn_ = turn;
  for (const Moved& from : moved_) {
    const glm::dvec3 rest_m(from.position_m);
    mesh.position_m[from.vertex] = glm::vec3(with_bust(rig_, turn, rest_m));
    mesh.normal[from.vertex] = glm::vec3(turned_with_bust(rig_, turn, rest_m, glm::dvec3(from.normal)));
  }
  return true;
}

}  // namespace strandcast
