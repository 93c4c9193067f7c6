#include "common/groom/curve_basis.h"

#include <algorithm>
#include <array>

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

}  // namespace

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
