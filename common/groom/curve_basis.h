// Evaluates USD's cubic curves at points evenly spaced in the curve parameter. Pure functions, any thread.
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

}  // namespace strandcast
