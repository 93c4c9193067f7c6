#include "common/math/bust.h"

#include <algorithm>
#include <cmath>

namespace strandcast {
namespace {

constexpr int kHeadingSteps = 2048, kLeanSteps = 511;  // either way
/// Tangent of half of the most that a chest leans.
constexpr double kMostLean = 0.6;
/// A turn whose sine of the half angle is below this is none: headings are rounded to 0.06 degrees, leans to
/// 0.2.
constexpr double kLeastTurn = 0.001;
/// Of without_bust(), as kBustRounds of shaders/sim/bust.glsl.
constexpr int kRounds = 4;

glm::dquat unit(const glm::dquat& q) {
  const double length = std::sqrt(((q.w * q.w + q.x * q.x) + q.y * q.y) + q.z * q.z);
  return length > 0.0 ? glm::dquat(q.w / length, q.x / length, q.y / length, q.z / length)
                      : glm::dquat(1.0, 0.0, 0.0, 0.0);
}

/// a b, in a fixed order of operations.
glm::dquat product(const glm::dquat& a, const glm::dquat& b) {
  return {
      ((a.w * b.w - a.x * b.x) - a.y * b.y) - a.z * b.z, ((a.w * b.x + a.x * b.w) + a.y * b.z) - a.z * b.y,
      ((a.w * b.y + a.y * b.w) + a.z * b.x) - a.x * b.z, ((a.w * b.z + a.z * b.w) + a.x * b.y) - a.y * b.x};
}

/// The part of a rotation about +Y; of what is upside down any will do.
glm::dquat twist_of(const glm::dquat& q) {
  return unit(q.w < 0.0 ? glm::dquat(-q.w, 0.0, -q.y, 0.0) : glm::dquat(q.w, 0.0, q.y, 0.0));
}

// Steps of leans are finer where chests are most of the time.
double lean_of(int step) {
  const double share = static_cast<double>(step) / kLeanSteps;
  return kMostLean * share * std::abs(share);
}
int lean_step(double lean) {
  const double share = std::clamp(lean / kMostLean, -1.0, 1.0);
  return static_cast<int>(std::lrint(std::copysign(std::sqrt(std::abs(share)), share) * kLeanSteps));
}

/// A point about the pivot by a share of the turn: between the identity and the quaternion on a line.
glm::dvec3 turned(const glm::dvec3& point, double share, const BustTurn& turn) {
  const double w = std::sqrt(std::max(1.0 - glm::dot(turn, turn), 0.0));
  const glm::dvec3 q = share * turn;
  const double real = 1.0 - share + share * w;
  const glm::dvec3 across = glm::cross(q, point);
  return point + (2.0 / (glm::dot(q, q) + real * real)) * (real * across + glm::cross(q, across));
}

/// Where the line from `over` at `low` to `under` at `high` is 0.
double crossing(double low, double over, double high, double under) {
  return over - under > 1e-9 ? low + (high - low) * (over / (over - under)) : low;
}

}  // namespace

BustCode bust_code(const glm::dquat& world_from_chest) {
  const glm::dquat heading = twist_of(world_from_chest);
  const glm::dquat lean = product(glm::conjugate(heading), world_from_chest);
  // tan(heading / 4): (cos, sin) of the half are (1 - u^2, 2 u) / (1 + u^2).
  const double u = heading.y / (1.0 + heading.w);
  const int turn =
      std::clamp(static_cast<int>(std::lrint(u * kHeadingSteps)), -kHeadingSteps, kHeadingSteps - 1);
  const double real = std::max(std::abs(lean.w), 1e-6);
  const double sign = lean.w < 0.0 ? -1.0 : 1.0;
  const int forward = lean_step(sign * lean.x / real), sideward = lean_step(sign * lean.z / real);
  return static_cast<BustCode>(turn + kHeadingSteps) | static_cast<BustCode>(forward + kLeanSteps + 1) << 12 |
         static_cast<BustCode>(sideward + kLeanSteps + 1) << 22;
}

glm::dquat chest_of(BustCode code) {
  const int turn = static_cast<int>(code & 4095u) - kHeadingSteps;
  const int forward = static_cast<int>(code >> 12 & 1023u) - kLeanSteps - 1;
  const int sideward = static_cast<int>(code >> 22) - kLeanSteps - 1;
  if (forward < -kLeanSteps || sideward < -kLeanSteps) return {1.0, 0.0, 0.0, 0.0};
  const double u = static_cast<double>(turn) / kHeadingSteps;
  const glm::dquat heading((1.0 - u * u) / (1.0 + u * u), 0.0, 2.0 * u / (1.0 + u * u), 0.0);
  return product(heading, unit({1.0, lean_of(forward), 0.0, lean_of(sideward)}));
}

BustTurn bust_turn(BustCode code, const glm::dquat& world_from_head) {
  if (code == kRigidBust) return BustTurn(0.0);
  const glm::dquat chest = unit(product(glm::conjugate(unit(world_from_head)), chest_of(code)));
  glm::dquat twist = twist_of(chest);
  glm::dquat bend = product(glm::conjugate(twist), chest);
  if (bend.w < 0.0) bend = -bend;
  if (std::abs(twist.y) > kMostTurnTangent * twist.w)
    twist = unit({1.0, 0.0, std::copysign(kMostTurnTangent, twist.y), 0.0});
  const double leans = std::sqrt(bend.x * bend.x + bend.z * bend.z);
  if (leans > kMostBendTangent * bend.w)
    bend = unit({1.0, kMostBendTangent * bend.x / leans, 0.0, kMostBendTangent * bend.z / leans});
  const glm::dquat turn = product(twist, bend);
  const BustTurn axis = turn.w < 0.0 ? BustTurn(-turn.x, -turn.y, -turn.z) : BustTurn(turn.x, turn.y, turn.z);
  return glm::dot(axis, axis) < kLeastTurn * kLeastTurn ? BustTurn(0.0) : axis;
}

BustTurn between(const BustTurn& from, const BustTurn& to, double share) {
  return (1.0 - share) * from + share * to;
}

double bust_share(const BustRig& rig, const glm::dvec3& rest_m) {
  const glm::dvec4 share(rig.share);
  const double t =
      std::clamp(share.w - ((share.x * rest_m.x + share.y * rest_m.y) + share.z * rest_m.z), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

glm::dvec3 with_bust(const BustRig& rig, const BustTurn& turn, const glm::dvec3& rest_m) {
  const double share = rig.exists() && turn != BustTurn(0.0) ? bust_share(rig, rest_m) : 0.0;
  if (share == 0.0) return rest_m;
  const glm::dvec3 pivot_m(rig.pivot_m);
  return pivot_m + turned(rest_m - pivot_m, share, turn);
}

glm::dvec3 without_bust(const BustRig& rig, const BustTurn& turn, const glm::dvec3& point_m) {
  if (!rig.exists() || turn == BustTurn(0.0)) return point_m;
  const glm::dvec3 pivot_m(rig.pivot_m);
  const auto rest_at = [&](double share) { return pivot_m + turned(point_m - pivot_m, share, -turn); };
  // The share at a place is that of the place: a zero between 0 and 1, by the Illinois method (Dowell and
  // Jarratt 1971).
  double low = 0.0, high = 1.0, side = 0.0;
  double over = bust_share(rig, point_m);
  if (over == 0.0) return point_m;
  double under = bust_share(rig, rest_at(1.0)) - 1.0;
  if (under == 0.0) return rest_at(1.0);
  double share = crossing(low, over, high, under);
  for (int round = 0; round < kRounds; ++round) {
    const double error = bust_share(rig, rest_at(share)) - share;
    if (error > 0.0) {
      low = share, over = error;
      if (side > 0.0) under *= 0.5;
      side = 1.0;
    } else {
      high = share, under = error;
      if (side < 0.0) over *= 0.5;
      side = -1.0;
    }
    share = crossing(low, over, high, under);
  }
  return rest_at(share);
}

glm::dvec3 turned_with_bust(const BustRig& rig, const BustTurn& turn, const glm::dvec3& rest_m,
                            const glm::dvec3& direction) {
  const double share = rig.exists() && turn != BustTurn(0.0) ? bust_share(rig, rest_m) : 0.0;
  return share == 0.0 ? direction : turned(direction, share, turn);
}

}  // namespace strandcast
