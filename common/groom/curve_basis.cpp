#include "common/groom/curve_basis.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace strandcast {
namespace {

/// Weights of the four control points at parameter u of a segment.
std::array<float, 4> weights_at(CurveBasis basis, float u) {
  const float v = 1.0f - u, u2 = u * u, u3 = u2 * u;
  switch (basis) {
    case CurveBasis::Bezier:
      return {v * v * v, 3.0f * u * v * v, 3.0f * u2 * v, u3};
    case CurveBasis::BSpline:
      return {v * v * v / 6.0f, (3.0f * u3 - 6.0f * u2 + 4.0f) / 6.0f,
              (-3.0f * u3 + 3.0f * u2 + 3.0f * u + 1.0f) / 6.0f, u3 / 6.0f};
    case CurveBasis::CatmullRom:
      return {0.5f * (-u3 + 2.0f * u2 - u), 0.5f * (3.0f * u3 - 5.0f * u2 + 2.0f),
              0.5f * (-3.0f * u3 + 4.0f * u2 + u), 0.5f * (u3 - u2)};
  }
  return {};
}

Status check(const KnotCurve& curve) {
  const size_t count = curve.control.size();
  if (curve.order < 2 || curve.order > kMaxCurveOrder || count < curve.order)
    return make_error(ErrorCode::BadInput, "{} control points of order {}, allowed are orders 2 to {}", count,
                      curve.order, kMaxCurveOrder);
  if (curve.knots.size() != count + curve.order || (!curve.weights.empty() && curve.weights.size() != count))
    return make_error(ErrorCode::BadInput, "{} knots and {} weights for {} control points of order {}",
                      curve.knots.size(), curve.weights.size(), count, curve.order);
  for (size_t i = 0; i < curve.knots.size(); ++i) {
    if (!std::isfinite(curve.knots[i]) || (i > 0 && curve.knots[i] < curve.knots[i - 1]))
      return make_error(ErrorCode::BadInput, "knot {} is {}: knots may not fall", i, curve.knots[i]);
  }
  if (!(curve.knots[curve.order - 1] < curve.knots[count]))
    return make_error(ErrorCode::BadInput, "its knots are all {}", curve.knots[count]);
  for (const double weight : curve.weights) {
    if (!(weight > 0.0) || !std::isfinite(weight))
      return make_error(ErrorCode::BadInput, "a weight is {}, it has to be above 0", weight);
  }
  return {};
}

/// The point at a parameter within knots[k] and knots[k + 1]: de Boor's triangle, with weights as a fourth
/// coordinate.
glm::dvec3 point_at(const KnotCurve& curve, size_t k, double t) {
  const size_t degree = curve.order - 1;
  std::array<glm::dvec4, kMaxCurveOrder> point;
  for (size_t j = 0; j <= degree; ++j) {
    const size_t i = k - degree + j;
    const double weight = curve.weights.empty() ? 1.0 : curve.weights[i];
    point[j] = glm::dvec4(glm::dvec3(curve.control[i]), 1.0) * weight;
  }
  for (size_t round = 1; round <= degree; ++round) {
    for (size_t j = degree; j >= round; --j) {
      const double low = curve.knots[k - degree + j], high = curve.knots[k + 1 + j - round];
      const double blend = high > low ? (t - low) / (high - low) : 0.0;
      point[j] = glm::mix(point[j - 1], point[j], blend);
    }
  }
  return glm::dvec3(point[degree]) / point[degree].w;
}

}  // namespace

Result<std::vector<glm::vec3>> points_on_curve(const KnotCurve& curve) {
  RETURN_IF_ERROR(check(curve));
  const size_t count = curve.control.size();
  const double begin = curve.knots[curve.order - 1], end = curve.knots[count];
  std::vector<glm::vec3> on_curve;
  size_t k = curve.order - 1;
  for (size_t i = 0; i < count; ++i) {
    const double t = begin + (end - begin) * static_cast<double>(i) / static_cast<double>(count - 1);
    while (k + 1 < count && curve.knots[k + 1] <= t) ++k;
    on_curve.emplace_back(point_at(curve, k, t));
  }
  return on_curve;
}

Result<std::vector<glm::vec3>> points_on_curve(std::span<const glm::vec3> control, CurveBasis basis,
                                               CurveEnds ends) {
  const bool is_bezier = basis == CurveBasis::Bezier;
  const bool is_pinned = ends == CurveEnds::Pinned && !is_bezier;
  const size_t least = is_pinned ? 2 : 4;
  if (control.size() < least || (is_bezier && control.size() % 3 != 1))
    return make_error(ErrorCode::BadInput, "{} control points, {}", control.size(),
                      is_bezier ? std::string("a bezier curve has 4, 7, 10 and so on")
                                : fmt::format("at least {} are needed", least));
  // A pinned curve has one more point before and behind, so that it begins and ends on its own.
  std::vector<glm::vec3> all(control.begin(), control.end());
  if (is_pinned) {
    all.insert(all.begin(), 2.0f * control[0] - control[1]);
    all.push_back(2.0f * control[control.size() - 1] - control[control.size() - 2]);
  }
  const size_t stride = is_bezier ? 3 : 1;
  const size_t segment_count = (all.size() - 4) / stride + 1;
  std::vector<glm::vec3> on_curve(control.size());
  for (size_t i = 0; i < on_curve.size(); ++i) {
    const double t = static_cast<double>(i) * static_cast<double>(segment_count) /
                     static_cast<double>(on_curve.size() - 1);
    const size_t segment = std::min(static_cast<size_t>(t), segment_count - 1);
    const auto weight = weights_at(basis, static_cast<float>(t - static_cast<double>(segment)));
    for (size_t k = 0; k < weight.size(); ++k) on_curve[i] += weight[k] * all[segment * stride + k];
  }
  return on_curve;
}

}  // namespace strandcast
