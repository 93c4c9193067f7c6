#include "server/sim/reference_contact.h"

#include <algorithm>
#include <cmath>

#include "server/sim/directions.h"
#include "server/sim/strand_layout.h"

namespace strandcast {
namespace {

constexpr double kTinyContact = 1e-12;

}  // namespace

size_t sphere_count(const StepInput& input) {
  return std::min<size_t>(input.colliders.size(), kMaxSphereColliders);
}

ReferenceSphere sphere_of(const StepInput& input, size_t index) {
  const SphereCollider& given = input.colliders[index];
  return {limited(glm::dvec3(given.center_m), kMaxColliderM),
          std::max(0.0, limited(given.radius_m, kMaxColliderM))};
}

ReferenceSphere deepest_sphere(const StepInput& input, const glm::dvec3& point_m) {
  ReferenceSphere deepest;
  double most = 0.0;
  for (size_t c = 0; c < sphere_count(input); ++c) {
    const ReferenceSphere sphere = sphere_of(input, c);
    const glm::dvec3 outward = point_m - sphere.center_m;
    const double inside = sphere.radius_m * sphere.radius_m - glm::dot(outward, outward);
    if (inside <= most) continue;
    most = inside;
    deepest = sphere;
  }
  return deepest;
}

int push_rounds(const StepInput& input) {
  return sphere_count(input) > 1 ? 2 : 1;
}

// Seen from the head the skin is bent from one pose of the bust to the other. Its place at rest says which
// part of the chest's turn it takes.
glm::dvec3 ReferenceSkin::carried(const glm::dvec3& old_m) const {
  const BustInput& bust = input.bust;
  const glm::dvec3 with_head = carry * old_m;
  if (!bust.rig.exists()) return with_head;
  const glm::dquat rotation = limited_rotation(input.world_from_head_rotation);
  const glm::dvec3 rest = without_bust(bust.rig, bust.turn_before, glm::conjugate(rotation) * with_head);
  return rotation * with_bust(bust.rig, bust.turn, rest);
}

glm::dvec3 ReferenceSkin::on_bust(const glm::dvec3& groomed_m) const {
  const BustInput& bust = input.bust;
  if (!bust.rig.exists()) return groomed_m;
  const glm::dquat rotation = limited_rotation(input.world_from_head_rotation);
  return rotation * with_bust(bust.rig, bust.turn, glm::conjugate(rotation) * groomed_m);
}

glm::dvec3 held_by_friction(const ReferenceSkin& skin, const glm::dvec3& old_m, const glm::dvec3& point_m,
                            const ReferenceSphere& sphere) {
  const double distance = glm::distance(point_m, sphere.center_m);
  if (distance < kTinyContact) return point_m;
  const glm::dvec3 normal = (point_m - sphere.center_m) / distance;
  const glm::dvec3 slip = point_m - skin.carried(old_m);
  const glm::dvec3 sliding = slip - normal * glm::dot(slip, normal);
  const double way = glm::length(sliding);
  if (way < kTinyContact) return point_m;
  return point_m - sliding * std::min(1.0, skin.friction * (sphere.radius_m - distance) / way);
}

glm::dvec3 shortened(const glm::dvec3& value, double longest) {
  const double length = glm::length(value);
  return length > longest ? value * (longest / length) : value;
}

glm::dvec3 turned_onto_sphere(const ReferenceSegment& segment, const glm::dvec3& center, double radius) {
  const double length = segment.length_m;
  const glm::dvec3 to_center = center - segment.start_m;
  const double distance = glm::length(to_center);
  if (distance < kTinyContact || length < kTinyContact) return segment.end_m;
  const glm::dvec3 axis = to_center / distance;
  // Law of cosines in the triangle start, end, center.
  const double cosine = std::clamp(
      (length * length + distance * distance - radius * radius) / (2.0 * length * distance), -1.0, 1.0);
  const glm::dvec3 along = segment.end_m - segment.start_m;
  glm::dvec3 side = along - axis * glm::dot(along, axis);
  const double side_length = glm::length(side);
  side = side_length > kTinyContact ? side / side_length : any_perpendicular(axis);
  return segment.start_m + length * (cosine * axis + std::sqrt(1.0 - cosine * cosine) * side);
}

// Woodhouse 2017 solves collider and length constraints in turn and leaves the exact solution of both
// (figure 4.1) out for its cost; turning the segment onto the sphere is that exact solution. Several
// colliders: out of the one with the largest r^2 - |p - c|^2 first, then once more.
glm::dvec3 pushed_out(const ReferenceSkin& skin, ReferenceSegment segment) {
  const StepInput& input = skin.input;
  for (int round = 0; round < push_rounds(input); ++round) {
    ReferenceSphere sphere = deepest_sphere(input, segment.end_m);
    if (segment.groomed_m)
      sphere.radius_m =
          std::min(sphere.radius_m, glm::distance(skin.on_bust(*segment.groomed_m), sphere.center_m));
    if (glm::distance(segment.end_m, sphere.center_m) >= sphere.radius_m) break;
    segment.end_m = held_by_friction(skin, segment.old_m, segment.end_m, sphere);
    segment.end_m = turned_onto_sphere(segment, sphere.center_m, sphere.radius_m);
  }
  return segment.end_m;
}

glm::dvec3 air_velocity_mps(const StepInput& input, const glm::dvec3& point_m) {
  glm::dvec3 result = limited(input.wind_mps, kMaxWindMps);
  const size_t count = std::min<size_t>(input.gusts.size(), kMaxGustWaves);
  for (size_t i = 0; i < count; ++i) {
    const GustWave& wave = input.gusts[i];
    const glm::dvec3 wave_vector = limited(glm::dvec3(wave.wave_vector_rad_per_m), kMaxPhaseRad);
    const double angle = glm::dot(wave_vector, point_m) - limited(wave.phase_rad, kMaxPhaseRad);
    result += limited(glm::dvec3(wave.amplitude_mps), kMaxWindMps) * std::sin(angle);
  }
  return result;
}

}  // namespace strandcast
