#include "common/groom/hair_style.h"

#include <algorithm>
#include <cmath>

#include "common/base/hash.h"

namespace strandcast {
namespace {

constexpr float kPartingWidth = 0.05f;  // over which the side changes
constexpr float kPartingAt = 0.10f;     // x of the parting: a little to one side looks natural
constexpr float kPartingWave = 0.03f;   // it is not a straight line
constexpr float kSwayNoise = 0.22f;     // slow change over the scalp
constexpr float kSwayStrand = 0.05f;    // from strand to strand
constexpr float kNoiseCells = 2.5f;     // per skull radius
constexpr float kMinClearance = 0.015f;
constexpr float kTopClearance = 0.11f;  // more at the top of the head
constexpr float kClearanceNoise = 0.035f;
constexpr float kClearanceArc = 0.35f;  // arc length over which a strand rises to its clearance
// The face and jaw as a sphere that hair does not enter either.
constexpr glm::vec3 kFaceCenter{0.0f, -0.42f, 0.22f};
constexpr float kFaceRadius = 0.86f;

float smooth(float low, float high, float value) {
  const float t = std::clamp((value - low) / (high - low), 0.0f, 1.0f);
  return t * t * (3.0f - 2.0f * t);
}

float lattice(const glm::ivec3& cell, uint32_t salt) {
  uint32_t hash = salt;
  for (int axis = 0; axis < 3; ++axis) hash = mix_u32(hash ^ static_cast<uint32_t>(cell[axis]));
  return unit_float(hash) * 2.0f - 1.0f;
}

/// Smooth noise in -1..1 with one value per unit cell.
float noise(const glm::vec3& point, uint32_t salt) {
  const glm::vec3 floor = glm::floor(point);
  const glm::ivec3 cell(floor);
  const glm::vec3 part = point - floor;
  const glm::vec3 blend = part * part * (3.0f - 2.0f * part);
  float sum = 0.0f;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::ivec3 step(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
    float weight = 1.0f;
    for (int axis = 0; axis < 3; ++axis) weight *= step[axis] == 1 ? blend[axis] : 1.0f - blend[axis];
    sum += weight * lattice(cell + step, salt);
  }
  return sum;
}

glm::vec3 noise_vector(const glm::vec3& point, uint32_t salt) {
  return {noise(point, mix_u32(salt + 1)), noise(point, mix_u32(salt + 2)), noise(point, mix_u32(salt + 3))};
}

glm::vec3 push_out(const glm::vec3& point, const glm::vec3& center, float radius) {
  const glm::vec3 offset = point - center;
  const float distance = glm::length(offset);
  if (distance >= radius || distance == 0.0f) return point;
  return center + offset * (radius / distance);
}

}  // namespace

StrandCharacter make_character(const glm::vec3& root, uint32_t strand_hash, uint32_t seed) {
  StrandCharacter character;
  character.root = root;
  const glm::vec3 place = root * kNoiseCells;
  const float parting = kPartingAt + kPartingWave * noise(place * 2.0f, mix_u32(seed + 11));
  character.side = std::tanh((root.x - parting) / kPartingWidth);
  const float height = smooth(-0.5f, 1.0f, root.y / std::max(glm::length(root), 1e-6f));
  const float lift = noise(place * 1.7f, mix_u32(seed + 23)) + (unit_float(mix_u32(strand_hash + 5)) - 0.5f);
  character.clearance =
      std::max(kMinClearance, kMinClearance + kTopClearance * height + kClearanceNoise * lift);
  const glm::vec3 own(unit_float(mix_u32(strand_hash + 1)), unit_float(mix_u32(strand_hash + 2)),
                      unit_float(mix_u32(strand_hash + 3)));
  character.sway = kSwayNoise * noise_vector(place, seed) + kSwayStrand * (own * 2.0f - 1.0f);
  return character;
}

glm::vec3 combed_direction(const glm::vec3& point, const StrandCharacter& character) {
  const glm::vec3 outward = point / std::max(glm::length(point), 1e-6f);
  // Combed only while the strand lies on the head; below and away from it, gravity alone.
  const float on_head = smooth(-0.7f, 0.1f, point.y);
  const float front = smooth(-0.15f, 0.65f, outward.z) * on_head;
  const float top = smooth(0.35f, 0.95f, outward.y);
  const float before_crown = smooth(-0.75f, -0.2f, outward.z);
  glm::vec3 direction(0.0f, -1.0f, 0.0f);
  direction.x += character.side * (1.5f * front + 1.3f * top * before_crown);
  direction.z -= 0.85f * front + 0.45f * top + 0.8f * smooth(0.05f, 0.6f, point.z) * (1.0f - top);
  direction += character.sway * (0.25f + 0.75f * on_head);
  return glm::normalize(direction);
}

glm::vec3 keep_outside(const glm::vec3& point, float arc, const StrandCharacter& character) {
  const float risen = 1.0f - std::exp(-arc / kClearanceArc);
  const float root_distance = glm::length(character.root);
  const float floor =
      std::min(1.0f, root_distance) * (1.0f - smooth(0.0f, 0.05f, arc)) + smooth(0.0f, 0.05f, arc);
  const glm::vec3 outside = push_out(point, glm::vec3(0.0f), floor + character.clearance * risen);
  // A scalp that itself reaches into the face sphere keeps its roots where they are.
  const float face_radius = std::min(kFaceRadius, 0.99f * glm::distance(character.root, kFaceCenter));
  return push_out(outside, kFaceCenter, face_radius + 0.5f * character.clearance * risen);
}

}  // namespace strandcast
