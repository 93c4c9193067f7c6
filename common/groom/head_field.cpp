#include "common/groom/head_field.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace strandcast {
namespace {

enum class Shape { Ellipsoid, Capsule };
enum class Blend { Add, Cut };

/// One part of the head. Parts off the middle are given once and mirrored.
struct Part {
  Shape shape;
  Blend blend;
  float softness;     // width of the blend with what is there already
  glm::vec3 from;     // centre of the ellipsoid, or one end of the capsule
  glm::vec3 to;       // radii of the ellipsoid, or the other end of the capsule
  float from_radius;  // of the capsule
  float to_radius;
};

Part ellipsoid(Blend blend, float softness, const glm::vec3& center, const glm::vec3& radii) {
  return {Shape::Ellipsoid, blend, softness, center, radii, 0.0f, 0.0f};
}
Part capsule(Blend blend, float softness, const glm::vec3& from, float from_radius, const glm::vec3& to,
             float to_radius) {
  return {Shape::Capsule, blend, softness, from, to, from_radius, to_radius};
}

// Proportions of an adult head: eyes at half of its height, nose down to half of the rest, mouth at a third
// of that.
const std::array kParts = {
    ellipsoid(Blend::Add, 0.00f, {0.00f, 0.00f, 0.00f}, {0.985f, 0.985f, 0.985f}),               // cranium
    capsule(Blend::Add, 0.14f, {0.00f, -0.70f, -0.14f}, 0.52f, {0.00f, -1.75f, -0.34f}, 0.52f),  // neck
    capsule(Blend::Add, 0.30f, {0.00f, -2.25f, -0.38f}, 0.54f, {0.45f, -2.60f, -0.40f}, 0.50f),  // its base
    ellipsoid(Blend::Add, 0.22f, {0.00f, -0.50f, 0.28f}, {0.74f, 0.84f, 0.62f}),                 // face
    ellipsoid(Blend::Add, 0.26f, {0.00f, -0.86f, 0.26f}, {0.60f, 0.44f, 0.58f}),                 // jaw
    ellipsoid(Blend::Add, 0.16f, {0.00f, -1.22f, 0.64f}, {0.24f, 0.17f, 0.20f}),                 // chin
    ellipsoid(Blend::Add, 0.20f, {0.46f, -0.42f, 0.60f}, {0.20f, 0.16f, 0.20f}),                 // cheekbone
    ellipsoid(Blend::Add, 0.16f, {0.00f, -0.84f, 0.70f}, {0.30f, 0.26f, 0.24f}),  // round the mouth
    ellipsoid(Blend::Cut, 0.18f, {0.34f, -0.20f, 1.03f}, {0.24f, 0.15f, 0.24f}),  // eye socket
    capsule(Blend::Add, 0.14f, {0.00f, -0.03f, 0.88f}, 0.07f, {0.44f, 0.00f, 0.76f}, 0.05f),  // brow
    ellipsoid(Blend::Add, 0.05f, {0.33f, -0.20f, 0.755f}, {0.165f, 0.115f, 0.145f}),          // closed eye
    capsule(Blend::Add, 0.14f, {0.00f, -0.08f, 0.88f}, 0.07f, {0.00f, -0.50f, 1.08f},
            0.10f),                                                                // bridge of the nose
    ellipsoid(Blend::Add, 0.08f, {0.00f, -0.53f, 1.11f}, {0.12f, 0.10f, 0.11f}),   // its tip
    ellipsoid(Blend::Add, 0.07f, {0.13f, -0.56f, 1.00f}, {0.08f, 0.075f, 0.11f}),  // its wing
    capsule(Blend::Add, 0.10f, {0.05f, -0.805f, 0.925f}, 0.055f, {0.25f, -0.87f, 0.79f}, 0.01f),  // upper lip
    capsule(Blend::Add, 0.10f, {0.00f, -0.93f, 0.925f}, 0.06f, {0.24f, -0.87f, 0.78f}, 0.01f),    // lower lip
    capsule(Blend::Cut, 0.08f, {0.00f, -0.868f, 1.025f}, 0.02f, {0.25f, -0.87f, 0.885f}, 0.005f),  // mouth
    ellipsoid(Blend::Cut, 0.12f, {0.00f, -1.05f, 0.99f}, {0.16f, 0.05f, 0.10f}),   // below the lips
    ellipsoid(Blend::Add, 0.06f, {0.965f, -0.28f, 0.02f}, {0.09f, 0.28f, 0.16f}),  // ear
    ellipsoid(Blend::Cut, 0.06f, {1.07f, -0.26f, 0.05f}, {0.05f, 0.17f, 0.08f}),   // its shell
};
constexpr float kNeckCutAt = -2.35f;
constexpr float kNeckCutSoftness = 0.25f;

float ellipsoid_distance(const glm::vec3& point, const glm::vec3& radii) {
  const float scaled = glm::length(point / radii);
  const float slope = glm::length(point / (radii * radii));
  return slope > 0.0f ? scaled * (scaled - 1.0f) / slope : -std::min({radii.x, radii.y, radii.z});
}

float capsule_distance(const glm::vec3& point, const Part& part) {
  const glm::vec3 axis = part.to - part.from, offset = point - part.from;
  const float along = std::clamp(glm::dot(offset, axis) / glm::dot(axis, axis), 0.0f, 1.0f);
  return glm::length(offset - along * axis) - glm::mix(part.from_radius, part.to_radius, along);
}

/// Smaller of two distances with a rounded seam (polynomial smooth minimum).
float smooth_min(float a, float b, float softness) {
  if (softness <= 0.0f) return std::min(a, b);
  const float near = std::max(softness - std::abs(a - b), 0.0f) / softness;
  return std::min(a, b) - near * near * softness * 0.25f;
}

}  // namespace

float head_distance(const glm::vec3& point) {
  const glm::vec3 mirrored(std::abs(point.x), point.y, point.z);
  float distance = std::numeric_limits<float>::max();
  for (const Part& part : kParts) {
    const float own = part.shape == Shape::Ellipsoid ? ellipsoid_distance(mirrored - part.from, part.to)
                                                     : capsule_distance(mirrored, part);
    distance = part.blend == Blend::Add ? smooth_min(distance, own, part.softness)
                                        : -smooth_min(-distance, own, part.softness);
  }
  return -smooth_min(-distance, point.y - kNeckCutAt, kNeckCutSoftness);
}

glm::vec3 head_normal(const glm::vec3& point) {
  constexpr float kStep = 2e-3f;
  glm::vec3 slope;
  for (int axis = 0; axis < 3; ++axis) {
    glm::vec3 step(0.0f);
    step[axis] = kStep;
    slope[axis] = head_distance(point + step) - head_distance(point - step);
  }
  const float length = glm::length(slope);
  return length > 0.0f ? slope / length : glm::vec3(0.0f, 1.0f, 0.0f);
}

}  // namespace strandcast
