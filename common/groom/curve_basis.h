// Evaluates cubic curves of USD and splines with knots at points evenly spaced in the curve parameter. Pure
// functions, any thread.
#pragma once

#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "common/base/result.h"

namespace strandcast {

enum class CurveBasis { Bezier, BSpline, CatmullRom };
enum class CurveEnds {
  Open,    // USD's "nonperiodic": of a B-spline or Catmull-Rom curve, between the second and last but one
  Pinned,  // it begins at the first point and ends at the last
};

/// Returns as many points on the curve as it has control points; the first and last are its ends. BadInput if
/// their number does not fit the basis.
Result<std::vector<glm::vec3>> points_on_curve(std::span<const glm::vec3> control, CurveBasis basis,
                                               CurveEnds ends);

/// A B-spline curve with knots; the order is its degree and one more.
struct KnotCurve {
  std::span<const glm::vec3> control;
  std::span<const double> weights;  // one for each control point, or empty
  std::span<const double> knots;    // control points and order, together
  size_t order = 4;
};
inline constexpr size_t kMaxCurveOrder = 16;

/// Returns as many points on the curve as it has control points; the first and last are its ends. BadInput if
/// the sizes do not fit, knots fall or weights are not above 0.
Result<std::vector<glm::vec3>> points_on_curve(const KnotCurve& curve);

}  // namespace strandcast
