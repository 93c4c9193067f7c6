#include "common/groom/head_shape.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/base/quantile.h"
#include "common/groom/head_fit.h"
#include "common/strands/head/head_field.h"

namespace strandcast {
namespace {

constexpr double kSkull = 0.985;  // radius of the built-in cranium, in skull radii
/// Roots nearer to or further from the middle than this, in skull radii, are not on the head: a mane's on the
/// back.
constexpr double kNearestRoot = 0.7, kFurthestRoot = 1.35;
/// Standard deviations for the least squares of the ellipsoid: of a root, of the centre, of each stretch.
constexpr double kRootNoiseM = 0.004, kCenterNoiseM = 0.02, kStretchNoise = 0.08;
constexpr int kStretchRounds = 8;
/// Share of the roots in one direction that may lie below the skin.
constexpr double kRootQuantile = 0.3;
/// Angles over which skin follows roots, first far around, then near; what the built-in shape weighs against
/// roots that fill that angle.
constexpr std::array kRootReachRad = {0.5, 0.10};
constexpr double kBuiltInWeight = 0.08;
/// How steeply skin may give way to hair, in radii per radian, and how the dents are rounded.
constexpr double kDentSlope = 0.8, kDentReachRad = 0.07;
constexpr int kDentRounds = 3;
/// A vertex deeper than this share of the radius is a stray: skin does not give way. Nor does it leave roots
/// within this angle by more: hair that goes deeper there was made to end in the head, as that of a ponytail
/// under its band.
constexpr double kStrayPull = 0.6;
constexpr double kMostDentM = 0.003, kRootedRad = 0.15;
/// How far the built-in surface may rise between the centres of two directions (ears, nose), in skull radii.
constexpr double kCellSpread = 0.3;
/// No thinner than this share.
constexpr double kThinnestNeck = 0.45;
/// Before that the shoulders sink, and the neck between these heights gets longer: at most by so much, in
/// such steps, and only if that keeps clear of more of the hair than it costs in looks.
constexpr double kMostDrop = 0.7, kDropStep = 0.05, kDropCost = 0.5;
/// Fewer vertices than this share of the hair's count as if they were so many.
constexpr double kDropLeast = 0.02;
constexpr double kFurthestHead =
    1.95;                          // no part of the head without the bust is further away, in skull radii
constexpr double kFurthest = 5.5;  // nor any part of the bust

/// Visits every cell within `reach_rad` of a direction with its angle to it.
template <class Visit>
void near_cells(const glm::dvec3& direction, double reach_rad, const Visit& visit) {
  const std::vector<glm::dvec3>& cells = head::cell_directions();
  const double least = std::cos(std::min(reach_rad, std::numbers::pi));
  for (size_t i = 0; i < cells.size(); ++i) {
    const double cosine = glm::dot(cells[i], direction);
    if (cosine >= least) visit(i, std::acos(std::clamp(cosine, -1.0, 1.0)));
  }
}

double bell(double angle_rad, double reach_rad) {
  return std::exp(-0.5 * angle_rad * angle_rad / (reach_rad * reach_rad));
}

/// Distance from the skull's centre to the surface of the built-in head, in skull radii: the outermost, but
/// for the bust.
double built_in_radius(const glm::dvec3& direction) {
  constexpr int kSteps = 200;
  constexpr double kStep = kFurthestHead / kSteps;
  const auto distance = [&](double along) { return head_distance(glm::vec3(along * direction)); };
  for (double outside = kFurthestHead; outside > kStep;) {
    // The field is no true distance: half of it is a safe step.
    const double inside = outside - std::max(kStep, 0.5 * static_cast<double>(distance(outside)));
    if (distance(inside) < 0.0f) {
      double low = inside, high = outside;
      for (int i = 0; i < 20; ++i) (distance(0.5 * (low + high)) < 0.0f ? low : high) = 0.5 * (low + high);
      return 0.5 * (low + high);
    }
    outside = inside;
  }
  return kSkull;
}

const std::vector<double>& built_in_radii() {
  static const std::vector<double> kRadii = [] {
    std::vector<double> radii;
    for (const glm::dvec3& direction : head::cell_directions()) radii.push_back(built_in_radius(direction));
    return radii;
  }();
  return kRadii;
}

/// Gauss elimination of six normal equations, which the priors keep positive definite.
std::array<double, 6> solve(std::array<std::array<double, 7>, 6> rows) {
  for (size_t column = 0; column < 6; ++column)
    for (size_t row = column + 1; row < 6; ++row) {
      const double factor = rows[row][column] / rows[column][column];
      for (size_t k = column; k < 7; ++k) rows[row][k] -= factor * rows[column][k];
    }
  std::array<double, 6> solution{};
  for (size_t row = 6; row-- > 0;) {
    solution[row] = rows[row][6];
    for (size_t k = row + 1; k < 6; ++k) solution[row] -= rows[row][k] * solution[k];
    solution[row] /= rows[row][row];
  }
  return solution;
}

}  // namespace

HeadShape::HeadShape(const Groom& groom, const FittedSphere& about, HeadFit fit) {
  form_.center_m = glm::dvec3(about.center_m);
  form_.radius_m = glm::dvec3(static_cast<double>(about.radius_m));
  if (fit == HeadFit::Whole) {
    form_.radius_m /= kSkull;
    stretch_to_roots(groom);
    pull_to_roots(groom);
    give_way_to_hair(groom);
  }
  lower_shoulders(groom);
  narrow_neck(groom);
}

glm::dvec3 HeadShape::in_skull_radii(const glm::vec3& point_m) const {
  return (glm::dvec3(point_m) - form_.center_m) / form_.radius_m;
}

/// The built-in head's height that comes to lie at `y` when the neck is longer, and the other way round.
double HeadShape::before_the_drop(double y) const {
  const double stretched = head::kStretchTop - head::kStretchEnd + form_.drop;
  const double below = head::kStretchTop - y;
  return y + form_.drop * std::clamp(below / stretched, 0.0, 1.0);
}
// The least drop that pays: its share of kDropCost against the share of the hair that it keeps clear of.
void HeadShape::lower_shoulders(const Groom& groom) {
  std::vector<glm::dvec3> near;
  for (const glm::vec3& point : groom.rest_position_m) {
    const glm::dvec3 u = in_skull_radii(point);
    if (u.y < head::kStretchTop && glm::length(u) < kFurthest && distance_in_radii(u) < 0.0)
      near.push_back(u);
  }
  const double before = std::max(static_cast<double>(near.size()),
                                 kDropLeast * static_cast<double>(groom.rest_position_m.size()));
  double best = 0.0, least_cost = static_cast<double>(near.size()) / before;
  for (form_.drop = kDropStep; form_.drop < kMostDrop + 0.5 * kDropStep; form_.drop += kDropStep) {
    const auto inside = static_cast<double>(std::count_if(
        near.begin(), near.end(), [&](const glm::dvec3& u) { return distance_in_radii(u) < 0.0; }));
    const double cost = inside / before + kDropCost * form_.drop / kMostDrop;
    if (cost < least_cost) least_cost = cost, best = form_.drop;
  }
  form_.drop = best;
}

// Least squares of an ellipsoid through the mean root of each direction, with what is known of heads as
// prior.
void HeadShape::stretch_to_roots(const Groom& groom) {
  std::vector<glm::dvec4> cells(head::kCells, glm::dvec4(0.0));
  for (const glm::vec3& root : roots_of(groom)) {
    const glm::dvec3 u = in_skull_radii(root);
    const double length = glm::length(u);
    if (length >= kNearestRoot && length <= kFurthestRoot)
      cells[static_cast<size_t>(head::cell_of(u / length))] += glm::dvec4(glm::dvec3(root), 1.0);
  }
  std::vector<glm::dvec3> points;
  for (const glm::dvec4& cell : cells)
    if (cell.w > 0.0) points.push_back(glm::dvec3(cell) / cell.w);
  const glm::dvec3 center_m = form_.center_m, radius_m = form_.radius_m;
  glm::dvec3 stretch(0.0);  // logarithm of the factor on the radius
  for (int round = 0; round < kStretchRounds; ++round) {
    std::array<std::array<double, 7>, 6> rows{};
    const double root_weight = 1.0 / (kRootNoiseM * kRootNoiseM);
    for (const glm::dvec3& point : points) {
      const glm::dvec3 q = (point - form_.center_m) / form_.radius_m;
      const double length = glm::length(q);
      if (!(length > 0.0)) continue;
      const glm::dvec3 n = q / length;
      const double error_m = (length - kSkull) * radius_m.x;
      const glm::dvec3 by_center = -n / form_.radius_m * radius_m.x, by_stretch = -n * q * radius_m.x;
      const std::array<double, 6> slope = {by_center.x,  by_center.y,  by_center.z,
                                           by_stretch.x, by_stretch.y, by_stretch.z};
      // Huber: beyond the noise a root pulls no harder.
      const double weight =
          root_weight * std::min(1.0, 2.0 * kRootNoiseM / std::max(std::abs(error_m), 1e-12));
      for (size_t i = 0; i < 6; ++i) {
        for (size_t k = 0; k < 6; ++k) rows[i][k] += weight * slope[i] * slope[k];
        rows[i][6] -= weight * slope[i] * error_m;
      }
    }
    for (int axis = 0; axis < 3; ++axis) {
      const double center_weight = 1.0 / (kCenterNoiseM * kCenterNoiseM);
      const double stretch_weight = 1.0 / (kStretchNoise * kStretchNoise);
      const auto c = static_cast<size_t>(axis), s = static_cast<size_t>(axis + 3);
      rows[c][c] += center_weight;
      rows[c][6] -= center_weight * (form_.center_m[axis] - center_m[axis]);
      rows[s][s] += stretch_weight;
      rows[s][6] -= stretch_weight * stretch[axis];
    }
    const std::array<double, 6> step = solve(rows);
    for (int axis = 0; axis < 3; ++axis) {
      form_.center_m[axis] += step[static_cast<size_t>(axis)];
      stretch[axis] = std::clamp(stretch[axis] + step[static_cast<size_t>(axis + 3)], -0.3, 0.3);
      form_.radius_m[axis] = radius_m[axis] * std::exp(stretch[axis]);
    }
  }
}

void HeadShape::pull_to_roots(const Groom& groom) {
  std::vector<std::vector<double>> wanted(head::kCells);
  for (const glm::vec3& root : roots_of(groom)) {
    const glm::dvec3 u = in_skull_radii(root);
    const double length = glm::length(u);
    if (!(length > 0.0)) continue;
    const double pull = length / head::blend(built_in_radii(), u / length);
    if (length <= kFurthestRoot && pull >= kNearestRoot && pull <= kFurthestRoot)
      wanted[static_cast<size_t>(head::cell_of(u / length))].push_back(pull);
  }
  for (std::vector<double>& pulls : wanted)
    if (!pulls.empty()) pulls = {quantile(std::move(pulls), kRootQuantile)};
  for (const double reach_rad : kRootReachRad) {
    // What roots in every direction would weigh.
    const double full = 0.5 * head::kCells * reach_rad * reach_rad;
    std::vector<double> sum(head::kCells, 0.0), weight(head::kCells, kBuiltInWeight * full);
    for (size_t cell = 0; cell < wanted.size(); ++cell) {
      if (wanted[cell].empty()) continue;
      const double missing = wanted[cell].front() - form_.pull[cell];
      near_cells(head::cell_directions()[cell], 3.0 * reach_rad, [&](size_t near, double angle_rad) {
        const double here = bell(angle_rad, reach_rad);
        sum[near] += here * missing;
        weight[near] += here;
      });
    }
    for (size_t cell = 0; cell < form_.pull.size(); ++cell) form_.pull[cell] += sum[cell] / weight[cell];
  }
}

/// How far the skin may give way, by direction.
std::vector<double> HeadShape::deepest_dents(const Groom& groom) const {
  std::vector<double> floor(head::kCells, kStrayPull);
  const double dent = kMostDentM / ((form_.radius_m.x + form_.radius_m.y + form_.radius_m.z) / 3.0);
  std::vector<bool> has_roots(head::kCells, false);
  for (const glm::vec3& root : roots_of(groom)) {
    const glm::dvec3 u = in_skull_radii(root);
    const double length = glm::length(u);
    if (!(length > 0.0) || length > kFurthestRoot) continue;
    const double pull = length / head::blend(built_in_radii(), u / length);
    if (pull >= kNearestRoot && pull <= kFurthestRoot)
      has_roots[static_cast<size_t>(head::cell_of(u / length))] = true;
  }
  for (size_t cell = 0; cell < has_roots.size(); ++cell)
    if (has_roots[cell])
      near_cells(head::cell_directions()[cell], kRootedRad,
                 [&](size_t near, double) { floor[near] = std::max(kStrayPull, form_.pull[near] - dent); });
  return floor;
}

void HeadShape::give_way_to_hair(const Groom& groom) {
  const std::vector<double> floor = deepest_dents(groom);
  for (int round = 0; round < kDentRounds; ++round) {
    std::vector<double> most(head::kCells, std::numeric_limits<double>::max());
    bool is_clear = true;
    for (const glm::vec3& point : groom.rest_position_m) {
      const glm::dvec3 u = in_skull_radii(point);
      const double length = glm::length(u);
      if (!(length > 0.0) || length > kFurthest) continue;
      const double pull = form_.pull_at(u);
      if (u.y < head::kNeckTop * pull) continue;
      if (length > pull * (head::blend(built_in_radii(), u / length) + kCellSpread)) continue;
      if (!(head_distance(glm::vec3(u / pull)) < 0.0f)) continue;
      const double wanted = length / built_in_radius(u / length);
      if (wanted < head::blend(floor, u / length)) continue;
      double& least = most[static_cast<size_t>(head::cell_of(u / length))];
      least = std::min(least, wanted - (pull - wanted) * 0.25 * round);
      is_clear = false;
    }
    if (is_clear) return;
    std::vector<double> dented = form_.pull;
    for (size_t cell = 0; cell < most.size(); ++cell) {
      if (most[cell] >= form_.pull[cell]) continue;
      const double reach_rad = (form_.pull[cell] - most[cell]) / kDentSlope + 0.1;
      near_cells(head::cell_directions()[cell], reach_rad, [&](size_t near, double angle_rad) {
        dented[near] = std::min(dented[near], most[cell] + kDentSlope * angle_rad);
      });
    }
    // Rounded where something was dented, and nowhere above it.
    for (size_t cell = 0; cell < dented.size(); ++cell) {
      double sum = 0.0, weight = 0.0;
      near_cells(head::cell_directions()[cell], 2.5 * kDentReachRad, [&](size_t near, double angle_rad) {
        const double here = bell(angle_rad, kDentReachRad);
        sum += here * dented[near];
        weight += here;
      });
      form_.pull[cell] = std::min(form_.pull[cell], sum / weight);
    }
  }
}

// Each vertex inside of the neck makes it as thin there as it has to be; then the widths are evened out.
void HeadShape::narrow_neck(const Groom& groom) {
  for (int round = 0; round < kDentRounds; ++round) {
    std::vector<double> wanted = form_.neck_width;
    for (const glm::vec3& point : groom.rest_position_m) {
      const glm::dvec3 u = in_skull_radii(point);
      if (!(glm::length(u) <= kFurthest) || u.y >= head::kNeckTop) continue;
      const glm::dvec3 v = before_the_fit(u), axis = head::neck_axis(v.y);
      const glm::dvec3 offset = (v - axis) / form_.neck_width_at(v);
      const auto is_inside = [&](double width) {
        return head_distance(glm::vec3(axis + width * offset)) < 0.0f;
      };
      // By how much wider the point would have to lie to be on the skin.
      double low = 1.0, high = 1.0 / kThinnestNeck;
      if (!is_inside(low) || is_inside(high)) continue;
      for (int i = 0; i < 16; ++i) {
        const double middle = 0.5 * (low + high);
        (is_inside(middle) ? low : high) = middle;
      }
      const glm::dvec2 at = head::neck_grid(v);
      for (int corner = 0; corner < 4; ++corner) {
        const size_t cell = head::neck_cell(static_cast<int>(at.x) + corner % 2,
                                            (static_cast<int>(at.y) + corner / 2) % head::kNeckColumns);
        wanted[cell] = std::min(wanted[cell], form_.neck_width[cell] / high);
      }
    }
    for (int row = 0; row < head::kNeckRows; ++row)
      for (int column = 0; column < head::kNeckColumns; ++column) {
        double sum = 0.0, weight = 0.0;
        for (int dr = -2; dr <= 2; ++dr)
          for (int dc = -2; dc <= 2; ++dc) {
            const double here = std::exp(-0.5 * (dr * dr + dc * dc));
            sum += here * wanted[head::neck_cell(row + dr, column + dc)];
            weight += here;
          }
        double& width = form_.neck_width[head::neck_cell(row, column)];
        width = std::clamp(std::min(wanted[head::neck_cell(row, column)], sum / weight), kThinnestNeck, 1.0);
      }
    for (int column = 0; column < head::kNeckColumns; ++column)
      form_.neck_width[head::neck_cell(0, column)] = 1.0;
  }
}

/// Where the built-in head has the point, but for the widths.
glm::dvec3 HeadShape::before_the_fit(const glm::dvec3& u) const {
  glm::dvec3 v = u / form_.pull_at(u);
  v.y = before_the_drop(v.y);
  return v;
}

/// About the distance of a point in (stretched) skull radii.
double HeadShape::distance_in_radii(const glm::dvec3& u) const {
  const glm::dvec3 v = before_the_fit(u), axis = head::neck_axis(v.y);
  // The width belongs to the place before it was made thin, which lies in the same direction from the axis.
  return static_cast<double>(head_distance(glm::vec3(axis + (v - axis) / form_.neck_width_at(v)))) *
         form_.pull_at(u);
}

double HeadShape::distance_m(const glm::dvec3& point_m) const {
  const double mean_radius_m = (form_.radius_m.x + form_.radius_m.y + form_.radius_m.z) / 3.0;
  return distance_in_radii((point_m - form_.center_m) / form_.radius_m) * mean_radius_m;
}

}  // namespace strandcast
