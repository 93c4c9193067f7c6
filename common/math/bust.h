// The bust under a head: neck and chest in a pose of their own. The chest is turned about the top of the
// neck, and the neck is bent between head and chest, by a share that grows with the way down. Pure functions,
// any thread; + - * / and roots of doubles only, so that everybody has the same bits.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>

namespace strandcast {

/// Where a mesh has its neck. Head space, at rest.
struct BustRig {
  glm::vec3 pivot_m{0.0f};  // top of the neck
  /// Of a place p the chest's share is smooth(t), t = share.w - dot(share.xyz, p): 0 head .. 1 chest.
  glm::vec4 share{0.0f};

  /// Without it the bust is as rigid as the head.
  bool exists() const { return glm::vec3(share) != glm::vec3(0.0f); }
  bool operator==(const BustRig&) const = default;
};

/// How the chest is turned against the head: x, y, z of a unit quaternion with w > 0, head space. Zero: not.
using BustTurn = glm::dvec3;

/// Tangents of half of the most that a neck turns about its own axis (75 degrees) and bends (35); beyond that
/// the chest goes along.
inline constexpr double kMostTurnTangent = 0.7673;
inline constexpr double kMostBendTangent = 0.3153;

/// A chest's rotation in the world in 32 bits, as snapshots have it. From the lowest: 12 bits heading, 10
/// bits lean forwards, 10 bits lean sideways. It is never kRigidBust.
using BustCode = uint32_t;
inline constexpr BustCode kRigidBust = 0;  // the chest is turned as the head is
BustCode bust_code(const glm::dquat& world_from_chest);
/// What is left of a rotation after that; the identity for kRigidBust and what is no code.
glm::dquat chest_of(BustCode code);

/// From one turn to the other, exact at both ends.
BustTurn between(const BustTurn& from, const BustTurn& to, double share);

/// The chest under this head, no further than necks turn. A turn below a tenth of a degree is none.
BustTurn bust_turn(BustCode code, const glm::dquat& world_from_head);

/// 0 head .. 1 chest, of a place at rest.
double bust_share(const BustRig& rig, const glm::dvec3& rest_m);
/// Where the skin's place at rest is under this turn.
glm::dvec3 with_bust(const BustRig& rig, const BustTurn& turn, const glm::dvec3& rest_m);
/// The other way round, to 0.05 mm of a head's size.
glm::dvec3 without_bust(const BustRig& rig, const BustTurn& turn, const glm::dvec3& point_m);
/// A direction of the skin at this place at rest.
glm::dvec3 turned_with_bust(const BustRig& rig, const BustTurn& turn, const glm::dvec3& rest_m,
                            const glm::dvec3& direction);

}  // namespace strandcast
