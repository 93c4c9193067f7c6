#include "server/sim/solvers/tractrix/tractrix_step.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/base/hash.h"

namespace strandcast {
namespace {

constexpr double kTinyPull = 1e-14;
constexpr uint32_t kRounds = 3;

}  // namespace

// Zappe 2020, 2.2.3, steps 1 to 9, with one change. The curve with its parameter p along the way, in units of
// the segment: tail = (-tanh p, sech p) seen from the head, and p grows by the way. Zappe finds p from
// y = sech p, which has two answers and none that is good near y = 1; the tangent of the angle, sinh p, has
// one everywhere.
glm::dvec3 tractrix_followed(const glm::dvec3& head_before, const glm::dvec3& head, const glm::dvec3& tail,
                             double segment_m) {
  const glm::dvec3 shift = head - head_before;
  const glm::dvec3 edge = tail - head_before;
  const double way_m = glm::length(shift);
  const double length_m = glm::length(edge);
  if (way_m == 0.0) return tail;
  if (length_m < kTinyPull || segment_m < kTinyPull) return tail + shift;
  const glm::dvec3 x_axis = shift / way_m;
  const double behind = -glm::dot(edge, x_axis) / length_m;
  const glm::dvec3 across = edge / length_m + behind * x_axis;
  const double aside = glm::length(across);
  if (aside == 0.0) return tail + shift;
  const double p = std::asinh(behind / aside) + way_m / segment_m;
  const glm::dvec3 turned = -std::tanh(p) * x_axis + across / (aside * std::cosh(p));
  return tail + shift + segment_m * (turned - edge / length_m);
}

std::vector<uint32_t> shuffled_order(uint32_t count, uint32_t seed) {
  std::vector<uint32_t> order;
  if (count == 0) return order;
  const auto bits = static_cast<uint32_t>(std::bit_width(std::max(count - 1u, 1u)));
  const uint32_t mask = (1u << bits) - 1u;
  for (uint32_t k = 0; k <= mask; ++k) {
    uint32_t value = k;
    uint32_t key = seed;
    for (uint32_t round = 0; round < kRounds; ++round) {
      key = mix_u32(key + round);
      value = (value * (key | 1u) + (key >> 16)) & mask;
      value ^= value >> ((bits + 1u) / 2u);
    }
    if (value < count) order.push_back(value);
  }
  return order;
}

}  // namespace strandcast
