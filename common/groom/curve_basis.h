// Cubic curves as USD has them: points on them, evenly in their parameter. Pure functions, any thread.
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

/// As many points on the curve as it has control points, the first and the last at its ends. BadInput where
/// their number does not fit the basis.
Result<std::vector<glm::vec3>> points_on_curve(std::span<const glm::vec3> control, CurveBasis basis,
                                               CurveEnds ends);

}  // namespace strandcast
