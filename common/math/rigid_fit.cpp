#include "common/math/rigid_fit.h"

#include <cmath>

#include "common/math/turn.h"

namespace strandcast {
namespace {

constexpr int kMostTurns = 100;  // of the search for a rotation
constexpr double kLastTurnRad = 1e-12;

glm::dvec3 middle_of(std::span<const glm::dvec3> points) {
  glm::dvec3 sum(0.0);
  for (const glm::dvec3& point : points) sum += point;
  return sum / static_cast<double>(points.size());
}

}  // namespace

// Mueller, Bender, Chentanez, Macklin, "A Robust Method to Extract the Rotational Part of Deformations",
// 2016, eq. 7, about the middles of both.
Pose rigid_fit(std::span<const glm::dvec3> from, std::span<const glm::dvec3> to, glm::dquat guess) {
  const glm::dvec3 from_middle = middle_of(from), to_middle = middle_of(to);
  glm::dmat3 moment(0.0);
  for (size_t i = 0; i < from.size(); ++i)
    moment += glm::outerProduct(to[i] - to_middle, from[i] - from_middle);
  for (int turn = 0; turn < kMostTurns; ++turn) {
    const glm::dmat3 rotation = glm::mat3_cast(guess);
    glm::dvec3 torque(0.0);
    double along = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
      torque += glm::cross(rotation[axis], moment[axis]);
      along += glm::dot(rotation[axis], moment[axis]);
    }
    if (along == 0.0) break;
    const glm::dvec3 turn_rad = torque / std::abs(along);
    guess = turned(guess, turn_rad);
    if (glm::length(turn_rad) < kLastTurnRad) break;
  }
  return {to_middle - guess * from_middle, guess};
}

}  // namespace strandcast
