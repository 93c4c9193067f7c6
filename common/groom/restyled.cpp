#include "common/groom/restyled.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

namespace strandcast {
namespace {

using Points = std::vector<glm::dvec3>;

Points points_of(const Groom& groom, uint32_t strand_index) {
  const auto first = groom.rest_position_m.begin() + groom.offset[strand_index];
  return {first, first + groom.vertex_count(strand_index)};
}

/// Arc length from the root to each point.
std::vector<double> arcs_of(const Points& points) {
  std::vector<double> arcs{0.0};
  for (size_t i = 1; i < points.size(); ++i)
    arcs.push_back(arcs.back() + glm::distance(points[i - 1], points[i]));
  return arcs;
}

double tricube(double share) {
  const double rest = 1.0 - share * share * share;
  return share < 1.0 ? rest * rest * rest : 0.0;
}

/// Value at 0 of the parabola that fits the points best, weighted, at these places; the weighted mean where
/// there are too few places for one.
glm::dvec3 parabola_at_0(const std::vector<double>& places, const std::vector<double>& weights,
                         const Points& points) {
  // Least squares over polynomials that are orthogonal under the weights (Forsythe 1957).
  const size_t count = places.size();
  std::vector<double> before(count, 0.0), here(count, 1.0);
  double before_at_0 = 0.0, here_at_0 = 1.0, norm_before = 1.0;
  glm::dvec3 value(0.0);
  constexpr int kDegree = 2;
  constexpr double kLeastNorm = 1e-9;  // beside that of the constant: no places for a higher degree
  double first_norm = 0.0;
  for (int degree = 0; degree <= kDegree; ++degree) {
    double norm = 0.0, moment = 0.0;
    glm::dvec3 along(0.0);
    for (size_t i = 0; i < count; ++i) {
      norm += weights[i] * here[i] * here[i];
      moment += weights[i] * here[i] * here[i] * places[i];
      along += weights[i] * here[i] * points[i];
    }
    if (degree == 0) first_norm = norm;
    if (norm <= kLeastNorm * first_norm) break;
    value += along / norm * here_at_0;
    const double shift = moment / norm, share = degree == 0 ? 0.0 : norm / norm_before;
    for (size_t i = 0; i < count; ++i) {
      const double next = (places[i] - shift) * here[i] - share * before[i];
      before[i] = std::exchange(here[i], next);
    }
    const double next_at_0 = -shift * here_at_0 - share * before_at_0;
    before_at_0 = std::exchange(here_at_0, next_at_0);
    norm_before = norm;
  }
  return value;
}

Points smooth_path(const Points& points) {
  const std::vector<double> arcs = arcs_of(points);
  Points path;
  for (size_t i = 0; i < points.size(); ++i) {
    std::vector<double> places, weights;
    for (const double arc : arcs) {
      places.push_back((arc - arcs[i]) / kSmoothReachM);
      weights.push_back(tricube(std::abs(places.back())));
    }
    path.push_back(parabola_at_0(places, weights, points));
  }
  return path;
}

/// What is pinned stays, and the change opens behind it over half of the reach.
void curl(Points& points, std::span<const uint8_t> pinned, double times) {
  const Points path = smooth_path(points);
  const std::vector<double> arcs = arcs_of(points);
  const auto opened = [](double arc_m) {
    const double share = std::clamp(arc_m / (0.5 * kSmoothReachM), 0.0, 1.0);
    return share * share * (3.0 - 2.0 * share);
  };
  for (size_t i = 0; i < points.size(); ++i) {
    if (pinned[i] != 0) continue;
    points[i] += (times - 1.0) * opened(arcs[i]) * (points[i] - path[i]);
  }
}

/// The point of the strand at this arc length, on the chord between two vertices.
glm::dvec3 point_at(const Points& points, const std::vector<double>& arcs, double arc_m) {
  const auto above = std::upper_bound(arcs.begin() + 1, arcs.end() - 1, arc_m);
  const auto i = static_cast<size_t>(above - arcs.begin());
  const double segment_m = arcs[i] - arcs[i - 1];
  if (segment_m <= 0.0) return points[i];
  return glm::mix(points[i - 1], points[i], std::clamp((arc_m - arcs[i - 1]) / segment_m, 0.0, 1.0));
}

/// Chords across corners are shorter than the way around them: the strand is scaled to its length.
void cut_or_stretch(Points& points, double times) {
  const std::vector<double> arcs = arcs_of(points);
  if (arcs.back() <= 0.0) return;
  Points result = points;
  if (times < 1.0)
    for (size_t i = 1; i < points.size(); ++i) result[i] = point_at(points, arcs, times * arcs[i]);
  const double scale = times * arcs.back() / arcs_of(result).back();
  for (size_t i = 1; i < points.size(); ++i) points[i] = points[0] + scale * (result[i] - points[0]);
}

}  // namespace

std::vector<glm::dvec3> smooth_path_of(const Groom& groom, uint32_t strand_index) {
  return smooth_path(points_of(groom, strand_index));
}

Groom restyled(Groom groom, double length, double curl_times) {
  for (uint32_t strand = 0; strand < groom.strand_count(); ++strand) {
    if (length == 1.0 && curl_times == 1.0) break;
    Points points = points_of(groom, strand);
    const std::span pinned = std::span(groom.pinned).subspan(groom.offset[strand], points.size());
    if (curl_times != 1.0) curl(points, pinned, curl_times);
    if (length != 1.0 && pinned.back() == 0) cut_or_stretch(points, length);
    std::copy(points.begin(), points.end(), groom.rest_position_m.begin() + groom.offset[strand]);
  }
  return groom;
}

}  // namespace strandcast
