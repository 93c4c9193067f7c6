#include "server/sim/reference_follicle.h"

#include <algorithm>
#include <cmath>

#include "server/sim/directions.h"
#include "server/sim/reference_contact.h"

namespace strandcast {
namespace {

constexpr double kTinyFollicleM = 1e-10;

/// A segment that turns in the plane of two perpendicular directions.
struct Turning {
  glm::dvec3 start_m;
  glm::dvec3 groomed;  // unit
  glm::dvec3 side;     // unit
  double length_m;
  glm::dvec3 end_m(double angle) const {
    return start_m + length_m * (std::cos(angle) * groomed + std::sin(angle) * side);
  }
};

/// The largest angle up to `angle` that a sphere leaves; `angle` itself where the groomed end is inside.
double angle_beside(const Turning& turning, double angle, const ReferenceSphere& sphere) {
  const auto is_inside = [&](double at) {
    return glm::distance(turning.end_m(at), sphere.center_m) < sphere.radius_m;
  };
  if (is_inside(0.0) || !is_inside(angle)) return angle;
  // |start + l d(angle) - c| = r: the angle between d and the way from c is the same on either side.
  const glm::dvec3 away = turning.start_m - sphere.center_m;
  const double x = glm::dot(away, turning.groomed);
  const double y = glm::dot(away, turning.side);
  const double cosine =
      (sphere.radius_m * sphere.radius_m - glm::dot(away, away) - turning.length_m * turning.length_m) /
      (2.0 * turning.length_m * std::hypot(x, y));
  return std::atan2(y, x) + std::acos(std::clamp(cosine, -1.0, 1.0));
}

}  // namespace

double angle_rad(const glm::dvec3& a, const glm::dvec3& b) {
  return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

bool hold_root(const StepInput& input, const ReferenceRoot& root) {
  const glm::dvec3 start = root.position_m[root.first - 1];
  const glm::dvec3 edge = root.position_m[root.first] - start;
  const double length_m = glm::length(edge);
  const double groomed_m = glm::length(root.groomed);
  if (!(length_m > kTinyFollicleM && groomed_m > kTinyFollicleM)) return false;
  if (!(angle_rad(edge, root.groomed) > input.follicle_limit_rad)) return false;

  Turning turning{start, root.groomed / groomed_m, {}, length_m};
  const glm::dvec3 aside = edge - turning.groomed * glm::dot(edge, turning.groomed);
  turning.side =
      glm::length(aside) > 1e-6 * length_m ? glm::normalize(aside) : any_perpendicular(turning.groomed);
  double angle = input.follicle_limit_rad;
  for (size_t c = 0; c < sphere_count(input); ++c) angle = angle_beside(turning, angle, sphere_of(input, c));

  glm::dvec3 shift = turning.end_m(angle) - root.position_m[root.first];
  if (const double way_m = glm::length(shift); way_m > kTinyFollicleM) {
    const glm::dvec3 along = shift / way_m;
    glm::dvec3& velocity_mps = root.velocity_mps[root.first];
    velocity_mps += std::max(0.0, -glm::dot(velocity_mps - root.follicle_mps, along)) * along;
  }
  root.position_m[root.first] += shift;
  for (size_t i = root.first + 1; i < root.position_m.size(); ++i) {
    const glm::dvec3 before = root.position_m[i - 1];
    const glm::dvec3 next = root.position_m[i] + shift;
    const glm::dvec3 end =
        pushed_out(ReferenceSkin{input}, {next, before, next, glm::distance(before, next)});
    shift = end - root.position_m[i];
    root.position_m[i] = end;
  }
  return true;
}

}  // namespace strandcast
