#include "common/groom/hair_style.h"

#include <algorithm>
#include <cmath>

#include "common/base/hash.h"
#include "common/strands/head/head_field.h"

namespace strandcast {
namespace {

constexpr float kPartingWidth = 0.05f;  // over which the side changes
constexpr float kMinSide = 0.6f;
constexpr float kPartingAt = 0.10f;    // x of the parting: a little to one side looks natural
constexpr float kPartingWave = 0.03f;  // it is not a straight line
// Hair that lies to both sides covers the scalp beside its parting by roots alone: they stand closer there.
constexpr float kPartingReach = 0.025f;  // over which they do, in skull radii
constexpr float kSwayNoise = 0.22f;      // slow change over the scalp
constexpr float kSwayStrand = 0.05f;     // from strand to strand
constexpr float kNoiseCells = 2.5f;      // per skull radius
constexpr float kMinClearance = 0.015f;
constexpr float kTopClearance = 0.11f;  // more at the top of the head
constexpr float kClearanceNoise = 0.035f;
constexpr float kClearanceArc = 0.35f;  // arc length over which a strand rises to its clearance
// The face and jaw as a sphere that hair does not enter either.
constexpr glm::vec3 kFaceCenter{0.0f, -0.42f, 0.22f};
constexpr float kFaceRadius = 0.86f;
// Below this height hair keeps clear of neck and shoulders, at first little, then as on the head.
constexpr float kBustTop = -0.75f;
constexpr float kBustClearance = 0.03f;
constexpr int kBustRounds = 3;

struct Ramp {
  float low, high;
};

// Where a strand is combed one way or the other, by its point or its direction from the centre; gravity pulls
// with 1.
constexpr Ramp kCombed = {-0.7f, 0.1f};         // height: below and away from the head, gravity alone
constexpr Ramp kFront = {-0.15f, 0.65f};        // towards the face
constexpr Ramp kTop = {0.35f, 0.95f};           // towards the crown
constexpr Ramp kBeforeCrown = {-0.75f, -0.2f};  // the parting ends at the crown
constexpr Ramp kCheek = {0.2f, 0.6f};           // in front of the ears
constexpr Ramp kBelowHead = {-1.2f, -0.5f};     // where hair gathers towards the neck
constexpr float kFrontAside = 1.5f, kTopAside = 1.3f;
constexpr float kFrontBack = 0.55f, kTopBack = 0.45f, kCheekBack = 0.8f;
constexpr float kGather = 0.14f;
constexpr float kNeckZ = -0.35f;
constexpr float kHangingSway = 0.25f;       // sway is stronger where hair lies on the head
constexpr Ramp kHeight = {-0.5f, 1.0f};     // of the root, for the clearance
constexpr Ramp kBustBelow = {0.75f, 1.1f};  // depth over which that clearance comes
constexpr Ramp kFromRoot = {0.0f, 0.05f};   // arc over which a root below the sphere comes up to it

float smooth(const Ramp& ramp, float value) {
  const float t = std::clamp((value - ramp.low) / (ramp.high - ramp.low), 0.0f, 1.0f);
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

float beside_parting(const glm::vec3& root, uint32_t seed) {
  return root.x - kPartingAt - kPartingWave * noise(root * kNoiseCells * 2.0f, mix_u32(seed + 11));
}

glm::vec3 moved_from_parting(const glm::vec3& root, uint32_t seed) {
  const glm::vec3 outward = root / std::max(glm::length(root), 1e-6f);
  // It ends at the crown.
  const float share = smooth(kTop, outward.y) * smooth(kBeforeCrown, outward.z);
  const float moved =
      (kPartingCloser - 1.0f) * kPartingReach * std::tanh(beside_parting(root, seed) / kPartingReach);
  return root + glm::vec3(share * moved, 0.0f, 0.0f);
}

StrandCharacter make_character(const glm::vec3& root, uint32_t strand_hash, uint32_t seed) {
  StrandCharacter character;
  character.root = root;
  const glm::vec3 place = root * kNoiseCells;
  // Nobody stays undecided on the parting: such a strand would fall over the face.
  const float side = std::tanh(beside_parting(root, seed) / kPartingWidth);
  character.side = std::copysign(std::max(std::abs(side), kMinSide), side);
  const float height = smooth(kHeight, root.y / std::max(glm::length(root), 1e-6f));
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
  const float on_head = smooth(kCombed, point.y);
  const float front = smooth(kFront, outward.z) * on_head;
  const float top = smooth(kTop, outward.y);
  const float gather = kGather * (1.0f - smooth(kBelowHead, point.y));
  glm::vec3 direction(0.0f, -1.0f, 0.0f);
  direction.x += character.side * (kFrontAside * front + kTopAside * top * smooth(kBeforeCrown, outward.z));
  direction.x -= gather * point.x;
  direction.z -= kFrontBack * front + kTopBack * top + kCheekBack * smooth(kCheek, point.z) * (1.0f - top);
  direction.z -= gather * (point.z - kNeckZ);
  direction += character.sway * glm::mix(kHangingSway, 1.0f, on_head);
  return glm::normalize(direction);
}

glm::vec3 keep_outside(const glm::vec3& point, float arc, const StrandCharacter& character) {
  const float risen = 1.0f - std::exp(-arc / kClearanceArc);
  const float root_distance = glm::length(character.root);
  const float floor = glm::mix(std::min(1.0f, root_distance), 1.0f, smooth(kFromRoot, arc));
  const glm::vec3 outside = push_out(point, glm::vec3(0.0f), floor + character.clearance * risen);
  // A scalp that itself reaches into the face sphere keeps its roots where they are.
  const float face_radius = std::min(kFaceRadius, 0.99f * glm::distance(character.root, kFaceCenter));
  return push_out(outside, kFaceCenter, face_radius + 0.5f * character.clearance * risen);
}

glm::vec3 keep_off_bust(const glm::vec3& point, const StrandCharacter& character) {
  const float clearance = kBustClearance + character.clearance;
  glm::vec3 outside = point;
  for (int round = 0; round < kBustRounds && outside.y < kBustTop; ++round) {
    const float missing = clearance * smooth(kBustBelow, -outside.y) - bust_distance(outside);
    if (missing <= 0.0f) break;
    outside += missing * bust_normal(outside);
  }
  return outside;
}

}  // namespace strandcast
