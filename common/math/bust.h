// Bust: neck and chest under a head, with a pose of their own. The chest rotates about the top of the neck.
// Between head and chest the neck bends by a share that grows downwards. Pure functions, any thread. They use
// only + - * / and square roots of doubles, so results are the same bits on every machine.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

namespace strandcast {

/// Location of the neck of a mesh at rest, in head space.
struct BustRig {
  glm::vec3 pivot_m{0.0f};  // top of the neck
  /// Plane that gives the chest's share of the motion at point p: smooth(t) with t = share.w - dot(share.xyz,
  /// p). 0 is head, 1 is chest.
  glm::vec4 share{0.0f};

  /// Returns whether the mesh has a bust; without one, it moves rigidly with the head.
  bool exists() const { return glm::vec3(share) != glm::vec3(0.0f); }
  bool operator==(const BustRig&) const = default;
};

/// Rotation of the chest relative to the head: x, y, z of a unit quaternion with w > 0, in head space. Zero
/// means no rotation.
using BustTurn = glm::dvec3;

/// Limits of the neck, as tangents of half the angle: 75 degrees about its own axis, 35 degrees of bending.
/// The chest follows rotations beyond them.
inline constexpr double kMostTurnTangent = 0.7673;
inline constexpr double kMostBendTangent = 0.3153;

/// Rotation of a chest in the world, packed into 32 bits for snapshots. From the lowest bit: 12 bits heading,
/// 10 bits leaning forwards, 10 bits leaning sideways. Never equals kRigidBust.
using BustCode = uint32_t;
inline constexpr BustCode kRigidBust = 0;  // the chest is turned as the head is
BustCode bust_code(const glm::dquat& world_from_chest);
/// Decodes a packed rotation; returns the identity for kRigidBust and for invalid codes.
glm::dquat chest_of(BustCode code);

/// Interpolates between two rotations by `share` (0..1), exact at both ends.
BustTurn between(const BustTurn& from, const BustTurn& to, double share);

/// Returns the rotation of the chest relative to this head, limited to what a neck can turn. Rotations below
/// a tenth of a degree become zero.
BustTurn bust_turn(BustCode code, const glm::dquat& world_from_head);

/// Share of the chest's motion at a point at rest (head space, m): 0 is head, 1 is chest.
double bust_share(const BustRig& rig, const glm::dvec3& rest_m);
/// Moves a point of the skin from its rest position (head space, m) to where this rotation takes it.
glm::dvec3 with_bust(const BustRig& rig, const BustTurn& turn, const glm::dvec3& rest_m);
/// Inverse of with_bust(), exact to 0.05 mm within the size of a head.
glm::dvec3 without_bust(const BustRig& rig, const BustTurn& turn, const glm::dvec3& point_m);
/// Rotates a direction attached to the skin at this rest position (head space, m).
glm::dvec3 turned_with_bust(const BustRig& rig, const BustTurn& turn, const glm::dvec3& rest_m,
                            const glm::dvec3& direction);

}  // namespace strandcast
