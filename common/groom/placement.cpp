#include "common/groom/placement.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <functional>
#include <numbers>
#include <vector>

#include "common/base/quantile.h"
#include "common/groom/head_fit.h"

namespace strandcast {
namespace {

/// Radii of the sphere through the roots of a human head, child to large adult with a wide hairline.
constexpr float kSmallestHeadRadiusM = 0.07f, kTypicalHeadRadiusM = 0.1f, kLargestHeadRadiusM = 0.12f;

/// Fewer roots say nothing of a head.
constexpr uint32_t kMinRoots = 64;
/// Another side is up only when it is better than +Y by this much: -1 to 1 for how far the roots cover that
/// side, and as much for how far the hair hangs from it.
constexpr double kClearlyBetter = 0.5;
/// Hair on one side alone, which may be brows, turns that side up where it hangs from it.
constexpr double kFallOfPiece = 0.1;
/// Roots that lie on that side of the head, and how far from the middle roots of a head are, in radii.
constexpr double kOnTop = 0.1, kNearestPlacedRoot = 0.7, kFurthestPlacedRoot = 1.35;
enum class RootReach { Head, Everywhere };
/// The hairline is looked at in so many directions round the head.
constexpr size_t kSectors = 8;
/// A few stray roots are no hairline.
constexpr double kHairlineShare = 0.05;
/// A hairline that rises and falls by less, in head radii, has no front.
constexpr double kMinHairlineSwing = 0.15;
constexpr double kQuarterTurnDeg = 90.0;
/// A face nearer than this to a quarter turn is there: by the mirror, which is 2 degrees off where hair is
/// not quite alike on both sides, or where it is nothing like that by the hairline alone, up to 29 degrees
/// off.
constexpr double kSnapDeg = 8.0, kLopsidedSnapDeg = 10.0, kHairlineSnapDeg = 32.0;
/// Of fewer roots than so many the mirror is up to 23 degrees off.
constexpr double kSparseSnapDeg = 25.0;
constexpr size_t kSparseRoots = 120;
/// The mirror is looked for so far from where the hairline is highest.
constexpr double kMirrorReachDeg = 45.0, kMirrorStepDeg = 0.25;
/// Hair whose two sides differ more, 0 to 1, is no mirror image: whole heads of 143 strands and more have up
/// to 0.04, those without a side or a patch 0.2 and more. Up to half, they say so much: near a quarter turn
/// it is that one.
constexpr double kMostSkew = 0.1, kAlikeSkew = 0.01, kLopsidedSkew = 0.19;

double angle_of(const glm::dvec3& direction) {
  return std::atan2(direction.x, direction.z);
}

/// Unit directions from the middle of the head to the roots. RootReach::Head leaves out those far from its
/// surface, as of a mane that goes on down the back.
std::vector<glm::dvec3> root_directions(const Groom& groom, RootReach reach) {
  const FittedSphere head = fit_head_sphere(groom);
  std::vector<glm::dvec3> directions;
  for (const glm::vec3& root : roots_of(groom)) {
    const glm::dvec3 offset = glm::dvec3(root) - glm::dvec3(head.center_m);
    const double length = glm::length(offset), radii = length / static_cast<double>(head.radius_m);
    if (!std::isfinite(length) || !(length > 0.0)) continue;
    if (reach == RootReach::Head && !(radii > kNearestPlacedRoot && radii < kFurthestPlacedRoot)) continue;
    directions.push_back(offset / length);
  }
  return directions;
}

/// Where around +Y hair grows: 1 on covered skin, 0 on bare, smooth over the spacing of roots, so that it
/// makes no difference how closely they stand where. Kept as the first harmonics of rings around +Y.
class HairCover {
 public:
  explicit HairCover(const std::vector<glm::dvec3>& directions) {
    std::vector<glm::dvec3> roots;
    const size_t stride = directions.size() / kMostRoots + 1;
    for (size_t i = 0; i < directions.size(); i += stride) roots.push_back(directions[i]);
    for (size_t ring = 0; ring < kRings; ++ring) {
      const double y = kTopRing * (2.0 * static_cast<double>(ring) + 1.0 - kRings) / kRings;
      for (size_t place = 0; place < kPlaces; ++place) {
        const double angle = 2.0 * std::numbers::pi * static_cast<double>(place) / kPlaces;
        const double across = std::sqrt(1.0 - y * y);
        const double cover = cover_at(roots, {across * std::sin(angle), y, across * std::cos(angle)});
        for (size_t i = 0; i < kOrders; ++i)
          harmonic_[ring][i] += std::polar(cover, static_cast<double>(i + 1) * angle);
      }
    }
  }
  /// Returns how unlike the two sides of the upright plane at this angle are: 0 = mirror images, at most 1.
  double skew(double angle) const {
    double odd = 0.0, all = 0.0;
    for (const auto& ring : harmonic_)
      for (size_t i = 0; i < kOrders; ++i) {
        const double part = (ring[i] * std::polar(1.0, -static_cast<double>(i + 1) * angle)).imag();
        odd += part * part;
        all += std::norm(ring[i]);
      }
    return all > 0.0 ? odd / all : 1.0;
  }

 private:
  static constexpr size_t kOrders = 8, kRings = 12, kPlaces = 72, kMostRoots = 1500;
  static constexpr double kTopRing = 0.95;
  static constexpr double kUsualArea = 0.6;  // of the sphere that hair covers
  static constexpr double kWhole = 3.0;      // evenly spread roots cover all but exp(-3) of their skin

  static double cover_at(const std::vector<glm::dvec3>& roots, const glm::dvec3& place) {
    const double root_area = 4.0 * std::numbers::pi * kUsualArea / static_cast<double>(roots.size());
    double sum = 0.0;
    for (const glm::dvec3& root : roots) sum += std::exp((glm::dot(root, place) - 1.0) / root_area);
    return 1.0 - std::exp(-kWhole * sum / (2.0 * std::numbers::pi));
  }

  std::array<std::array<std::complex<double>, kOrders>, kRings> harmonic_{};
};

/// The angle of the face near that of the hairline, in degrees, and from where on it is taken as a quarter
/// turn.
struct FaceAngle {
  double deg = 0.0, snap_deg = kHairlineSnapDeg;
};

FaceAngle face_by_mirror(const std::vector<glm::dvec3>& directions, double hairline_deg) {
  const HairCover cover(directions);
  double best_deg = hairline_deg, least = 1.0;
  for (double aside_deg = -kMirrorReachDeg; aside_deg <= kMirrorReachDeg; aside_deg += kMirrorStepDeg) {
    const double deg = std::round(hairline_deg) + aside_deg;
    const double skew = cover.skew(deg * std::numbers::pi / 180.0);
    if (skew >= least) continue;
    best_deg = std::remainder(deg, 360.0);
    least = skew;
  }
  const bool is_sparse = directions.size() < kSparseRoots;
  if (least < kMostSkew)
    return {best_deg, is_sparse ? kSparseSnapDeg : least < kAlikeSkew ? kSnapDeg : kLopsidedSnapDeg};
  const double off_deg = std::abs(std::remainder(best_deg, kQuarterTurnDeg));
  if (least < kLopsidedSkew && off_deg <= kLopsidedSnapDeg) return {best_deg, kLopsidedSnapDeg};
  return {hairline_deg};
}

/// What speaks for +Y being up.
struct Uprightness {
  double top = 0.0;   // 1 for roots that all lie on top of the head
  double fall = 0.0;  // 1 for hair that hangs straight down
};

Uprightness uprightness(const Groom& groom) {
  Uprightness result;
  const std::vector<glm::dvec3> directions = root_directions(groom, RootReach::Head);
  for (const glm::dvec3& direction : directions)
    result.top += direction.y / static_cast<double>(directions.size());
  double length = 0.0;
  for (uint32_t strand = 0; strand < groom.strand_count(); ++strand) {
    const float length_here = groom.length_m(strand);
    if (!std::isfinite(length_here)) continue;
    length += length_here;
    result.fall += static_cast<double>(groom.rest_position_m[groom.offset[strand]].y) -
                   groom.rest_position_m[groom.offset[strand + 1] - 1].y;
  }
  result.fall = length > 0.0 ? result.fall / length : 0.0;
  return result;
}

/// Hair that stands speaks against no side: it may be combed up.
double score_of(const Uprightness& up) {
  return up.top + std::max(up.fall, 0.0);
}

Groom upright_by(Groom groom, const UpSide& side) {
  GroomPlacement placement;
  placement.is_z_up = side.is_z_up;
  placement.is_upside_down = side.is_upside_down;
  for (glm::vec3& point : groom.rest_position_m) point = placement.turn(point);
  return groom;
}

}  // namespace

glm::vec3 GroomPlacement::turn(const glm::vec3& direction) const {
  return yawed(upright(direction));
}

glm::vec3 GroomPlacement::yawed(const glm::vec3& v) const {
  // Quarter turns are exact.
  if (yaw_deg == 0.0f) return v;
  if (yaw_deg == 90.0f) return {v.z, v.y, -v.x};
  if (yaw_deg == -90.0f) return {-v.z, v.y, v.x};
  if (std::abs(yaw_deg) == 180.0f) return {-v.x, v.y, -v.z};
  const double angle = static_cast<double>(yaw_deg) * std::numbers::pi / 180.0;
  const double c = std::cos(angle), s = std::sin(angle);
  return {static_cast<float>(c * v.x + s * v.z), v.y, static_cast<float>(c * v.z - s * v.x)};
}

Guess<UpSide> guess_up(const Groom& groom, const UpSide& assumed) {
  if (groom.strand_count() < kMinRoots) return {assumed, {}};
  Guess<UpSide> best{assumed, {}};
  const bool is_little = is_piece(upright_by(groom, assumed));
  double best_score = score_of(uprightness(upright_by(groom, assumed))) + kClearlyBetter;
  for (const UpSide& side : {UpSide{}, {true, false}, {false, true}, {true, true}}) {
    if (side == assumed) continue;
    const Uprightness up = uprightness(upright_by(groom, side));
    if (!(up.top > kOnTop && score_of(up) > best_score)) continue;
    if (is_little && !(up.fall > kFallOfPiece)) continue;
    best = {side, "the hair covers that side and hangs from it"};
    best_score = score_of(up);
  }
  return best;
}

const char* lies_aside(const Groom& groom, const UpSide& assumed) {
  if (groom.strand_count() < kMinRoots) return nullptr;
  const double least = score_of(uprightness(upright_by(groom, assumed))) + kClearlyBetter;
  for (const float sign : {1.0f, -1.0f}) {
    Groom turned = groom;
    for (glm::vec3& point : turned.rest_position_m) point = {-sign * point.y, sign * point.x, point.z};
    const Uprightness up = uprightness(turned);
    if (up.top > kOnTop && score_of(up) > least) return sign > 0.0f ? "+X" : "-X";
  }
  return nullptr;
}

const char* name_of(const UpSide& up) {
  return up.is_z_up ? (up.is_upside_down ? "-Z" : "+Z") : (up.is_upside_down ? "-Y" : "+Y");
}

const char* setting_of(const UpSide& up) {
  return up.is_z_up ? (up.is_upside_down ? "MINUS_Z" : "Z") : (up.is_upside_down ? "MINUS_Y" : "Y");
}

namespace {

/// The lowest of heights, but for stray ones; 1 where there are none. Many that are far below the others, as
/// those of a beard are below a forehead, are no hairline; a few may be a nape's.
double hairline_of(std::vector<double> heights) {
  constexpr double kLeastGap = 0.2, kSpacings = 15.0, kMany = 0.4;
  if (heights.empty()) return 1.0;
  std::sort(heights.begin(), heights.end(), std::greater<>());
  const auto count = static_cast<double>(heights.size());
  const double gap = std::max(kLeastGap, kSpacings / count);
  const auto below = std::adjacent_find(heights.begin(), heights.end(),
                                        [&](double above, double next) { return above - next > gap; });
  if (static_cast<double>(heights.end() - below) > kMany * count) heights.erase(below + 1, heights.end());
  return quantile(std::move(heights), kHairlineShare);
}

/// Where around +Y the lowest roots are highest: the first harmonic of the hairline's height.
glm::dvec3 hairline_rise(const std::vector<glm::dvec3>& directions) {
  std::array<std::vector<double>, kSectors> heights;
  for (const glm::dvec3& direction : directions) {
    const double turns = angle_of(direction) / (2.0 * std::numbers::pi) + 1.0;
    heights[static_cast<size_t>(turns * kSectors + 0.5) % kSectors].push_back(direction.y);
  }
  glm::dvec3 rise(0.0);
  // A sector without roots is bare up to the crown.
  for (size_t sector = 0; sector < kSectors; ++sector) {
    const double height = hairline_of(std::move(heights[sector]));
    const double angle = 2.0 * std::numbers::pi * static_cast<double>(sector) / kSectors;
    rise += 2.0 / kSectors * height * glm::dvec3(std::sin(angle), 0.0, std::cos(angle));
  }
  return rise;
}

/// Where around +Y roots are.
glm::dvec3 middle_around(const std::vector<glm::dvec3>& directions) {
  glm::dvec3 sum(0.0);
  for (const glm::dvec3& direction : directions)
    sum += glm::dvec3(direction.x, 0.0, direction.z) / static_cast<double>(directions.size());
  return sum;
}

}  // namespace

Guess<float> guess_yaw_deg(const Groom& groom) {
  if (groom.strand_count() < kMinRoots) return {};
  const HairPlace place = hair_place(groom);
  if (place == HairPlace::Body || (place == HairPlace::Head && is_piece(groom))) return {};
  const std::vector<glm::dvec3> directions = root_directions(groom, RootReach::Everywhere);
  const bool is_beard = place == HairPlace::Jaw;
  const char* const why = is_beard ? "the beard grows" : "the hairline is highest";
  const glm::dvec3 rise = is_beard ? middle_around(directions) : hairline_rise(directions);
  if (!(glm::length(rise) >= kMinHairlineSwing)) return {};
  const auto [face_deg, snap_deg] = face_by_mirror(directions, angle_of(rise) * 180.0 / std::numbers::pi);
  const double quarter_deg = kQuarterTurnDeg * std::round(face_deg / kQuarterTurnDeg);
  if (std::abs(face_deg - quarter_deg) > snap_deg) {
    const double whole_deg = std::round(face_deg);
    return {static_cast<float>(-whole_deg),
            fmt::format("{} about {} degrees from +Z towards +X", why, whole_deg)};
  }
  constexpr std::array kNames = {"-Z", "-X", "+Z", "+X", "-Z"};
  const auto quarters = static_cast<size_t>(quarter_deg / kQuarterTurnDeg + 2.5);
  return {static_cast<float>(quarter_deg == 180.0 ? 180.0 : 0.0 - quarter_deg),
          fmt::format("{} at {}", why, kNames[quarters])};
}

namespace {

/// Why roots say nothing of how large a head is; nullptr where they do.
const char* unlike_a_head(const Groom& groom) {
  constexpr uint32_t kFewRoots = 16;
  if (groom.strand_count() < kFewRoots) return "so few roots say nothing of a head";
  return are_on_a_disc(roots_of(groom)) ? "its roots lie in a plane" : nullptr;
}

/// What all strands but the longest are as long as.
double usual_length(const Groom& groom) {
  constexpr double kLongHair = 0.95;  // of strands
  std::vector<double> lengths;
  for (uint32_t strand = 0; strand < groom.strand_count(); ++strand) {
    double length = 0.0;
    for (uint32_t v = groom.offset[strand] + 1; v < groom.offset[strand + 1]; ++v)
      length += static_cast<double>(glm::distance(groom.rest_position_m[v], groom.rest_position_m[v - 1]));
    lengths.push_back(length);
  }
  return lengths.empty() ? 0.0 : quantile(lengths, kLongHair);
}

/// The first common unit in which fur and its body are as large as on an animal; no reason where there is
/// none.
Guess<float> unit_of_fur(const Groom& groom) {
  constexpr double kShortestM = 0.002, kLongestM = 0.25, kSmallestM = 0.05, kLargestM = 4.0;
  const double length = usual_length(groom);
  const glm::vec3 box = box_size_of(roots_of(groom));
  const double size = static_cast<double>(std::max({box.x, box.y, box.z}));
  for (const CommonUnit& unit : kCommonUnits) {
    const double length_m = length * static_cast<double>(unit.unit_m),
                 size_m = size * static_cast<double>(unit.unit_m);
    if (length_m >= kShortestM && length_m <= kLongestM && size_m >= kSmallestM && size_m <= kLargestM)
      return {unit.unit_m,
              fmt::format("these roots are no head of hair, and in {} the fur is {:.2g} m long on "
                          "a body of {:.2g} m",
                          unit.name, length_m, size_m)};
  }
  return {1.0f, {}};
}

/// The first common unit in which roots reach as far as on a side of a head; no reason where there is none.
Guess<float> unit_of_piece(const Groom& groom) {
  constexpr float kLeastM = 0.03f, kMostM = 0.25f;
  const float reach = extent_of(roots_of(groom));
  for (const CommonUnit& unit : kCommonUnits)
    if (reach * unit.unit_m >= kLeastM && reach * unit.unit_m <= kMostM)
      return {unit.unit_m, fmt::format("in {} its roots reach over {:.2g} m of one side of a head", unit.name,
                                       reach * unit.unit_m)};
  return {};
}

/// The first common unit in which hair is as long as on a head; no reason where there is none.
Guess<float> unit_by_length(const Groom& groom, const char* why) {
  constexpr double kShortestM = 0.03, kLongestM = 1.2;
  const double length = usual_length(groom);
  for (const CommonUnit& unit : kCommonUnits) {
    const double length_m = length * static_cast<double>(unit.unit_m);
    if (length_m >= kShortestM && length_m <= kLongestM)
      return {unit.unit_m, fmt::format("in {} its hair is {:.2g} m long, and {}", unit.name, length_m, why)};
  }
  return {};
}

}  // namespace

Guess<float> guess_unit(const Groom& groom) {
  const HairPlace place = hair_place(groom);
  if (place == HairPlace::Body) return unit_of_fur(groom);
  if (const char* const why = unlike_a_head(groom)) {
    if (Guess<float> by_length = unit_by_length(groom, why); !by_length.reason.empty()) return by_length;
    if (Guess<float> of_piece = unit_of_piece(groom); !of_piece.reason.empty()) return of_piece;
  }
  const float radius = fit_head_sphere(groom).radius_m;
  if (!std::isfinite(radius) || radius <= 0.0f) return {1.0f, {}};
  for (const CommonUnit& unit : kCommonUnits) {
    if (radius * unit.unit_m < kSmallestHeadRadiusM || radius * unit.unit_m > kLargestHeadRadiusM) continue;
    return {unit.unit_m, fmt::format("in {} the {} has the size of a person's", unit.name,
                                     place == HairPlace::Jaw ? "face behind this beard" : "head")};
  }
  if (place == HairPlace::Jaw) return {1.0f, {}};
  if (is_piece(groom))
    if (Guess<float> of_piece = unit_of_piece(groom); !of_piece.reason.empty()) return of_piece;
  return {kTypicalHeadRadiusM / radius, "that gives the head the size of a person's"};
}

}  // namespace strandcast
