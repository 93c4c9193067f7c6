#include "tests/support/strand_reference.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/base/hash.h"

namespace strandcast::reference {
namespace {
constexpr double kWaves = 2.5;
constexpr double kWaveShare = 0.35;

double random(uint32_t follower, uint32_t salt) {
  return unit_float(mix_u32(follower ^ salt));
}

}  // namespace

CurvePoint curve_point(const Keys& keys, uint32_t strand, uint32_t gap, double t) {
  const glm::dvec3 p0 = keys.vertex(strand, gap);
  const glm::dvec3 p1 = keys.vertex(strand, gap + 1);
  const glm::dvec3 m0 = gap == 0 ? p1 - p0 : (p1 - keys.vertex(strand, gap - 1)) / 2.0;
  const glm::dvec3 m1 = gap + 2 == keys.vertex_count ? p1 - p0 : (keys.vertex(strand, gap + 2) - p0) / 2.0;
  const double t2 = t * t;
  const double t3 = t2 * t;
  CurvePoint point;
  point.position_m =
      (2 * t3 - 3 * t2 + 1) * p0 + (t3 - 2 * t2 + t) * m0 + (-2 * t3 + 3 * t2) * p1 + (t3 - t2) * m1;
  point.derivative =
      (6 * t2 - 6 * t) * p0 + (3 * t2 - 4 * t + 1) * m0 + (-6 * t2 + 6 * t) * p1 + (3 * t2 - 2 * t) * m1;
  return point;
}

glm::dvec3 follower_weights(uint32_t follower) {
  const double root = std::sqrt(random(follower, 0x9e3779b9u));
  const double second = random(follower, 0x85ebca6bu);
  return {1.0 - root, root * (1.0 - second), root * second};
}

glm::dvec3 clumped_weights(const glm::dvec3& weights, double clump) {
  const glm::dvec3 pulled = (1.0 - clump) * weights + clump * weights * weights;
  return pulled / (pulled.x + pulled.y + pulled.z);
}

CurvePoint follower_point(const Keys& keys, const glm::uvec3& corner, uint32_t follower, double along,
                          const FollowerStyle& style) {
  const double end = 1.0 - style.shorten * random(follower, 0xc2b2ae35u);
  const double x = along * end * (keys.vertex_count - 1);
  const uint32_t gap = std::min(static_cast<uint32_t>(x), keys.vertex_count - 2);
  const glm::dvec3 weights = clumped_weights(follower_weights(follower), style.clump * along);
  CurvePoint sum;
  for (int i = 0; i < 3; ++i) {
    const CurvePoint key = curve_point(keys, corner[i], gap, x - gap);
    sum.position_m += weights[i] * key.position_m;
    sum.derivative += weights[i] * key.derivative;
  }
  const glm::dvec3 direction(2.0 * random(follower, 0x27d4eb2fu) - 1.0,
                             2.0 * random(follower, 0x165667b1u) - 1.0,
                             2.0 * random(follower, 0xd3a2646cu) - 1.0);
  const double phase = random(follower, 0xfd7046c5u);
  const double wave =
      std::sin(2.0 * std::numbers::pi * (kWaves * along + phase)) - std::sin(2.0 * std::numbers::pi * phase);
  const glm::dvec3 turned(direction.y, direction.z, direction.x);
  sum.position_m += style.variation_m * along * (direction + kWaveShare * wave * turned);
  return sum;
}

double line_coverage(double width_px, double distance_px) {
  const double low = std::max(distance_px - 0.5, -width_px / 2.0);
  const double high = std::min(distance_px + 0.5, width_px / 2.0);
  return std::max(0.0, high - low);
}

}  // namespace strandcast::reference
