#include "server/sim/reference_body.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "server/sim/reference_contact.h"

namespace strandcast {
namespace {

/// So much nearer than it was is no contact yet.
constexpr double kBodySlackM = 1e-6;
constexpr double kFarM = 1e6;

/// Of a segment's length: a side that is shorter is none, and what of a side is short of kKeptSide is made up
/// by where it was.
constexpr double kNoSide = 1e-4, kKeptSide = 0.1;

/// A ball of a capsule, by its place along the axis.
struct Ball {
  glm::dvec3 center_m{0.0};
  double radius_m = 0.0;
};
Ball ball_at(const BodyCapsule& capsule, double share) {
  return {glm::mix(capsule.from_m, capsule.to_m, share),
          glm::mix(capsule.from_radius_m, capsule.to_radius_m, share)};
}
double distance_to_ball(const Ball& ball, const glm::dvec3& point_m) {
  return glm::distance(ball.center_m, point_m) - ball.radius_m;
}

/// The place along the axis of the ball that the point is nearest to: distance is convex along it.
double nearest_share(const BodyCapsule& capsule, const glm::dvec3& point_m) {
  constexpr int kSteps = 45;  // 4e-10 of the length, and distances are flat there
  if (capsule.from_m == capsule.to_m) return capsule.from_radius_m < capsule.to_radius_m ? 1.0 : 0.0;
  const double golden = 0.5 * (std::sqrt(5.0) - 1.0);
  double low = 0.0, high = 1.0;
  const auto at = [&](double share) { return distance_to_ball(ball_at(capsule, share), point_m); };
  for (int step = 0; step < kSteps; ++step) {
    const double a = high - golden * (high - low), b = low + golden * (high - low);
    if (at(a) < at(b))
      high = b;
    else
      low = a;
  }
  double best = 0.5 * (low + high);
  for (const double end : {0.0, 1.0})
    if (at(end) < at(best)) best = end;
  return best;
}

struct Contact {
  glm::dvec3 normal{0.0};
  double depth_m = -kFarM;
  glm::dvec3 way_m{0.0};
  std::optional<Ball> ball;  // with the clearance; a plane has none
};

/// The foot of a point on the axis.
double foot(const glm::dvec3& from_m, const glm::dvec3& to_m, const glm::dvec3& point_m) {
  const glm::dvec3 axis = to_m - from_m;
  const double squared = glm::dot(axis, axis);
  return squared > 0.0 ? std::clamp(glm::dot(point_m - from_m, axis) / squared, 0.0, 1.0) : 0.0;
}

Contact touch(const BodyCapsule& capsule, const glm::dvec3& point_m, const glm::dvec3& before_m,
              double clearance_m) {
  const double share = nearest_share(capsule, point_m);
  Ball ball = ball_at(capsule, share);
  ball.radius_m += clearance_m;
  Contact contact;
  contact.ball = ball;
  contact.way_m = ball.center_m - glm::mix(capsule.from_before_m, capsule.to_before_m, share);
  const glm::dvec3 now = point_m - ball.center_m;
  contact.normal = glm::normalize(now);
  contact.depth_m = ball.radius_m - glm::length(now);
  // From the axis, then and now: has the way between led through the ball, past its middle?
  const double share_then = foot(capsule.from_before_m, capsule.to_before_m, before_m);
  const glm::dvec3 then = before_m - glm::mix(capsule.from_before_m, capsule.to_before_m, share_then);
  const double passing = foot(then, now, glm::dvec3(0.0));
  if (glm::dot(now, then) < 0.0 && glm::length(then) > kTinyLengthM && ball.radius_m > 0.0 &&
      glm::length(glm::mix(then, now, passing)) < ball.radius_m) {
    contact.normal = glm::normalize(then);
    contact.depth_m = ball.radius_m - glm::dot(now, contact.normal);
  }
  return contact;
}

Contact deepest(const BodyInput& body, const glm::dvec3& point_m, const glm::dvec3& before_m,
                double clearance_m) {
  Contact found;
  for (const BodyCapsule& capsule : body.capsules)
    if (const Contact contact = touch(capsule, point_m, before_m, clearance_m);
        contact.depth_m > found.depth_m)
      found = contact;
  for (const BodyPlane& plane : body.planes) {
    const double depth_m = clearance_m - glm::dot(plane.normal, point_m - plane.point_m);
    if (depth_m > found.depth_m) found = {plane.normal, depth_m, plane.shift_m, std::nullopt};
  }
  return found;
}

glm::dvec3 flat_side(const glm::dvec3& towards, const glm::dvec3& axis, const glm::dvec3& otherwise) {
  for (const glm::dvec3& candidate : {towards, otherwise}) {
    const glm::dvec3 flat = candidate - glm::dot(candidate, axis) * axis;
    if (glm::length(flat) > 1e-6 * glm::length(towards)) return glm::normalize(flat);
  }
  return glm::normalize(std::abs(axis.x) < 0.6 ? glm::dvec3(0.0, axis.z, -axis.y)
                                               : glm::dvec3(-axis.z, 0.0, axis.x));
}

/// A segment at this angle to the axis, on that side.
glm::dvec3 lean(const glm::dvec3& axis, const glm::dvec3& side, double length_m, double cosine) {
  const double bounded = std::clamp(cosine, -1.0, 1.0);
  return length_m * (bounded * axis + std::sqrt(1.0 - bounded * bounded) * side);
}

glm::dvec3 onto_plane(const Contact& contact, const glm::dvec3& edge, const glm::dvec3& held, double length_m,
                      double rise) {
  const double height_m = glm::dot(edge, contact.normal) + rise * contact.depth_m;
  return lean(contact.normal, flat_side(held, contact.normal, held), length_m, height_m / length_m);
}

/// Woodhouse 2017, figure 4.1; `was` is where the end was, from the start.
glm::dvec3 onto_ball(const Ball& ball, const glm::dvec3& start, const glm::dvec3& held, const glm::dvec3& was,
                     double length_m) {
  const glm::dvec3 to_center = ball.center_m - start;
  const double distance_m = glm::length(to_center);
  const glm::dvec3 axis = to_center / distance_m;
  const double cosine = (length_m * length_m + distance_m * distance_m - ball.radius_m * ball.radius_m) /
                        (2.0 * length_m * distance_m);
  glm::dvec3 side = held - glm::dot(held, axis) * axis;
  const glm::dvec3 side_was = was - glm::dot(was, axis) * axis;
  if (glm::length(side_was) > kNoSide * length_m) {
    const glm::dvec3 way_was = glm::normalize(side_was);
    const double along = glm::dot(side, way_was);
    side += (std::abs(along) - along) * way_was;
    side += std::max(0.0, kKeptSide * length_m - glm::length(side)) * way_was;
  }
  return lean(axis, flat_side(side, axis, side_was), length_m, cosine);
}

glm::dvec3 hold(const glm::dvec3& was_m, const glm::dvec3& end_m, const glm::dvec3& normal, double most_m) {
  const glm::dvec3 slip = end_m - was_m;
  const glm::dvec3 sliding = slip - glm::dot(slip, normal) * normal;
  const double way_m = glm::length(sliding);
  return way_m <= most_m ? end_m - sliding : end_m - most_m / way_m * sliding;
}

}  // namespace

double distance_to_capsule_m(const BodyCapsule& capsule, const glm::dvec3& point_m) {
  return distance_to_ball(ball_at(capsule, nearest_share(capsule, point_m)), point_m);
}

double distance_to_body_m(const BodyInput& body, const glm::dvec3& point_m) {
  return -deepest(body, point_m, point_m, 0.0).depth_m;
}

bool keep_out_of(const BodyInput& body, const ReferenceBodyStrand& strand) {
  const bool turns = body.response == BodyResponse::Turn || body.response == BodyResponse::Sphere;
  bool has_moved = false;
  glm::dvec3 start_before = strand.position_m[strand.first - 1];
  for (size_t i = strand.first; i < strand.position_m.size(); ++i) {
    const glm::dvec3 start = strand.position_m[i - 1];
    const glm::dvec3 place = strand.position_m[i];
    const double length_m = glm::distance(place, start_before);
    const double least_m = kBodyClearanceM + strand.arc[i] * (body.tip_clearance_m - kBodyClearanceM);
    glm::dvec3 end = place;
    if (turns && start != start_before)
      end = start + (glm::distance(place, start) > kTinyLengthM ? length_m * glm::normalize(place - start)
                                                                : place - start_before);
    const double clearance_m = body.is_new ? -kFarM : std::min(strand.clearance_m[i], least_m);
    for (int attempt = 0; attempt < 2 && length_m > kTinyLengthM && !body.is_new; ++attempt) {
      for (int round = 0; round < kMostRounds; ++round) {
        const Contact contact = deepest(body, end, strand.before_m[i], clearance_m);
        if (!(contact.depth_m > (round < 2 ? 0.0 : kResidueM))) break;
        const glm::dvec3 was = strand.before_m[i] + contact.way_m;
        const glm::dvec3 held = hold(was, end, contact.normal, body.friction * contact.depth_m);
        if (!turns)
          end = held + contact.depth_m * contact.normal;
        else if (body.response == BodyResponse::Sphere && contact.ball)
          end = start + onto_ball(*contact.ball, start, held - start, was - start, length_m);
        else
          end = start + onto_plane(contact, end - start, held - start, length_m, 1.0);
      }
      if (!turns) break;
      const Contact cut = deepest(body, 0.5 * (start + end),
                                  0.5 * (strand.before_m[i - 1] + strand.before_m[i]), clearance_m);
      if (!(cut.depth_m > 0.0)) break;
      end = start + onto_plane(cut, end - start, end - start, length_m, 2.0);
      if (!(cut.depth_m > kLookAgainM)) break;
    }
    if (clearance_m < least_m) {
      const double now_m =
          std::min(distance_to_body_m(body, end), distance_to_body_m(body, 0.5 * (start + end)));
      strand.clearance_m[i] = std::min(std::max(now_m - kBodySlackM, clearance_m), least_m);
    } else {
      strand.clearance_m[i] = least_m;
    }
    has_moved = has_moved || end != place;
    start_before = place;
    strand.position_m[i] = end;
  }
  return has_moved;
}

}  // namespace strandcast
