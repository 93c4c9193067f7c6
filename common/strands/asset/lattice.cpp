#include "common/strands/asset/lattice.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

namespace strandcast {
namespace asset {
namespace {

constexpr uint32_t kMantissaBits = 23;
constexpr uint32_t kExponentBias = 127;

/// Returns how many bits behind the point a number needs: more than kMaxStepBits where it is none of a
/// lattice.
uint32_t bits_behind_the_point(float x) {
  uint32_t bits = 0;
  std::memcpy(&bits, &x, sizeof bits);
  if (bits == 0) return 0;
  const uint32_t exponent = bits >> kMantissaBits & 0xffu;
  if (exponent == 0 || exponent == 0xffu) return kMaxStepBits + 1;  // -0, next to nothing, or no number
  const uint32_t mantissa = (bits & ((1u << kMantissaBits) - 1u)) | 1u << kMantissaBits;
  const int32_t behind =
      static_cast<int32_t>(kMantissaBits + kExponentBias - exponent) - std::countr_zero(mantissa);
  return static_cast<uint32_t>(std::max(behind, 0));
}

}  // namespace

std::optional<LatticePoints> to_lattice(std::span<const glm::vec3> points_m) {
  LatticePoints lattice;
  float farthest_m = 0.0f;
  for (const glm::vec3& point : points_m)
    for (int axis = 0; axis < 3; ++axis) {
      lattice.step_bits = std::max(lattice.step_bits, bits_behind_the_point(point[axis]));
      farthest_m = std::max(farthest_m, std::abs(point[axis]));
    }
  if (lattice.step_bits > kMaxStepBits) return {};
  const double steps_per_m = std::ldexp(1.0, static_cast<int>(lattice.step_bits));
  if (static_cast<double>(farthest_m) * steps_per_m >= kMaxStep) return {};
  lattice.point.reserve(points_m.size());
  for (const glm::vec3& point : points_m) lattice.point.emplace_back(glm::dvec3(point) * steps_per_m);
  return lattice;
}

std::vector<glm::vec3> to_metres(const LatticePoints& points) {
  const double step_m = std::ldexp(1.0, -static_cast<int>(points.step_bits));
  std::vector<glm::vec3> points_m;
  points_m.reserve(points.point.size());
  for (const glm::ivec3& point : points.point) points_m.emplace_back(glm::dvec3(point) * step_m);
  return points_m;
}

glm::vec3 rounded(const glm::vec3& point_m, uint32_t step_bits) {
  const double steps_per_m = std::ldexp(1.0, static_cast<int>(step_bits));
  glm::vec3 result;
  for (int axis = 0; axis < 3; ++axis)  // 0 is added to take the sign off a zero
    result[axis] = static_cast<float>(
        std::nearbyint(static_cast<double>(point_m[axis]) * steps_per_m) / steps_per_m + 0.0);
  return result;
}

}  // namespace asset

void round_to_lattice(std::span<glm::vec3> points_m, uint32_t step_bits) {
  for (glm::vec3& point : points_m) point = asset::rounded(point, step_bits);
}

}  // namespace strandcast
