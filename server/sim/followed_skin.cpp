#include "server/sim/followed_skin.h"

#include <algorithm>
#include <cmath>

#include "server/sim/reference_field.h"

namespace strandcast {
namespace {

constexpr float kTiny = 1e-12f;
/// As the simulated strands' (shaders/sim/field_collider.comp).
constexpr double kClearanceM = 0.0005;
constexpr double kSlackM = 1e-6;
constexpr double kLeastSlope = 0.5;
/// Distances between nodes change by at most so much per way.
constexpr float kMostSlope = 1.3f;
constexpr int kRounds = 2;

glm::vec3 any_side(const glm::vec3& axis) {
  return std::abs(axis.x) < 0.6f ? glm::vec3(0.0f, axis.z, -axis.y) : glm::vec3(-axis.z, 0.0f, axis.x);
}

/// The segment of this length that stands so high over its start along a unit vector, leaning to where
/// `towards` does; straight up or down where it is too short for that.
glm::vec3 leaning(const glm::vec3& towards, float length, const glm::vec3& up, float height) {
  const float cosine = std::clamp(height / length, -1.0f, 1.0f);
  glm::vec3 side = towards - up * glm::dot(towards, up);
  if (glm::dot(side, side) <= kTiny * length * length) side = any_side(up);
  side -= up * glm::dot(side, up);
  return length * (cosine * up + std::sqrt(1.0f - cosine * cosine) * glm::normalize(side));
}

}  // namespace

bool FollowedSkin::may_touch(const glm::vec3& end_m, float length_m, float& room_m) const {
  if (field != nullptr) {
    room_m -= kMostSlope * length_m;
    constexpr auto kClearance = static_cast<float>(kClearanceM);
    if (room_m < kClearance)
      room_m = static_cast<float>(sample_on_bust(*field, bust, glm::dvec3(end_m)).distance_m);
    if (room_m < kClearance + 0.5f * kMostSlope * length_m) return true;
  }
  return std::any_of(spheres.begin(), spheres.end(), [&](const SphereCollider& sphere) {
    const glm::vec3 outward = end_m - sphere.center_m;
    return glm::dot(outward, outward) < sphere.radius_m * sphere.radius_m;
  });
}

glm::vec3 FollowedSkin::turned_out(const Segment& segment) const {
  Segment turned = segment;
  if (!spheres.empty()) turned.end = out_of_spheres(turned);
  if (field != nullptr) turned.end = out_of_field(turned);
  return turned.end;
}

/// Out of the deepest sphere first, then once more, by the law of cosines in the triangle of start, end and
/// centre.
glm::vec3 FollowedSkin::out_of_spheres(const Segment& segment) const {
  glm::vec3 end = segment.end;
  const float length = glm::distance(segment.start, end);
  if (length * length <= kTiny) return end;
  const glm::vec3 groomed(with_bust(bust.rig, bust.turn, glm::dvec3(segment.groomed_end)));
  for (int round = 0; round < kRounds; ++round) {
    SphereCollider deepest{glm::vec3(0.0f), 0.0f};
    float most = 0.0f;
    for (const SphereCollider& sphere : spheres) {
      const glm::vec3 outward = end - sphere.center_m;
      const float inside = sphere.radius_m * sphere.radius_m - glm::dot(outward, outward);
      if (inside <= most) continue;
      most = inside;
      deepest = sphere;
    }
    deepest.radius_m = std::min(deepest.radius_m, glm::distance(groomed, deepest.center_m));
    if (glm::distance(end, deepest.center_m) >= deepest.radius_m) break;
    const glm::vec3 to_center = deepest.center_m - segment.start;
    const float distance = glm::length(to_center);
    if (distance * distance <= kTiny) break;
    const float height =
        (length * length + distance * distance - deepest.radius_m * deepest.radius_m) / (2.0f * distance);
    end = segment.start + leaning(end - segment.start, length, to_center / distance, height);
  }
  return end;
}

/// The end first, then the middle.
glm::vec3 FollowedSkin::out_of_field(const Segment& segment) const {
  glm::vec3 end = segment.end;
  const float length = glm::distance(segment.start, end);
  if (length * length <= kTiny) return end;
  const auto clearance_at = [&](const glm::vec3& groomed) {
    return std::min(kClearanceM, field->sample(glm::dvec3(groomed)).distance_m - kSlackM);
  };
  // A share of 1 looks at the end, one of a half at the middle.
  const auto turn_out = [&](float share, const glm::vec3& groomed) {
    const auto found =
        sample_on_bust(*field, bust, glm::dvec3(segment.start + share * (end - segment.start)));
    if (found.distance_m >= kClearanceM) return false;
    const double clearance_m = clearance_at(groomed);
    const double slope = glm::length(found.gradient);
    if (found.distance_m >= clearance_m || !(slope > 0.0)) return false;
    const auto depth = static_cast<float>((clearance_m - found.distance_m) / std::max(slope, kLeastSlope));
    const glm::vec3 normal(found.gradient / slope);
    const float height = glm::dot(normal, end - segment.start) + depth / share;
    end = segment.start + leaning(end - segment.start, length, normal, height);
    return true;
  };
  for (int round = 0; round < kRounds && turn_out(1.0f, segment.groomed_end); ++round) {
  }
  turn_out(0.5f, 0.5f * (segment.groomed_start + segment.groomed_end));
  return end;
}

}  // namespace strandcast
