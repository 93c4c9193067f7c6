#include "common/render/scatter/lobe_tables.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/packing.hpp>
#include <numbers>

#include "common/render/scatter/dual_scattering.h"
#include "shaders/shared/lobe_tables.h"

namespace strandcast::scatter {
namespace {

/// Texel i of n over the range 0 .. 1.
double share_of(uint32_t i, uint32_t n) {
  return static_cast<double>(i) / static_cast<double>(n - 1);
}

double absorption_of(uint32_t i, uint32_t n) {
  const double root = double{shader::kMaxRootAbsorption} * share_of(i, n);
  return root * root;
}

uint64_t packed(const std::array<double, 4>& values) {
  constexpr double kLargestHalf = 65504.0;
  glm::vec4 floats;
  for (int i = 0; i < 4; ++i)
    floats[i] = static_cast<float>(std::clamp(values[static_cast<size_t>(i)], -kLargestHalf, kLargestHalf));
  return glm::packHalf4x16(floats);
}

LookupTable empty_table(const glm::uvec3& size) {
  return {size, std::vector<uint64_t>(size_t{size.x} * size.y * size.z)};
}

uint64_t& texel(LookupTable& table, uint32_t x, uint32_t y, uint32_t z) {
  return table.texels[(size_t{z} * table.size.y + y) * table.size.x + x];
}

}  // namespace

LookupTable make_longitudinal_table(const std::array<LobeShape, 3>& shapes) {
  LookupTable table = empty_table({shader::kHalfAngleTexels, 1, 1});
  for (uint32_t x = 0; x < table.size.x; ++x) {
    const double half = std::numbers::pi * (share_of(x, table.size.x) - 0.5);
    texel(table, x, 0, 0) = packed(
        {longitudinal(shapes[0], half), longitudinal(shapes[1], half), longitudinal(shapes[2], half), 0.0});
  }
  return table;
}

LookupTable make_azimuthal_table(const CausticTerms& caustic) {
  LookupTable table =
      empty_table({shader::kAzimuthTexels, shader::kDifferenceTexels, shader::kAbsorptionTexels});
  const SmoothFibre fibre{kHairIndex, 0.0, caustic};
  for (uint32_t y = 0; y < table.size.y; ++y)
    for (uint32_t x = 0; x < table.size.x; ++x) {
      const double phi = std::numbers::pi * share_of(x, table.size.x);
      const double diff = std::acos(share_of(y, table.size.y));
      const double r = azimuthal(0, fibre, diff, phi);
      const Ways tt = azimuthal_ways(1, fibre, diff, phi), trt = azimuthal_trt_ways(fibre, diff, phi);
      for (uint32_t z = 0; z < table.size.z; ++z) {
        const double absorption = absorption_of(z, table.size.z);
        texel(table, x, y, z) = packed({r, sum_of(tt, absorption), sum_of(trt, absorption), 0.0});
      }
    }
  return table;
}

LookupTable make_average_table(const std::array<LobeShape, 3>& shapes, const CausticTerms& caustic) {
  LookupTable table =
      empty_table({shader::kInclinationTexels, shader::kAverageAbsorptionTexels, shader::kAverageLayers});
  const double width = shapes[0].width;
  const auto by_shift = [&](double shift) { return shapes[0].shift == 0.0 ? 0.0 : shift / shapes[0].shift; };
  SmoothFibre fibre{kHairIndex, 0.0, caustic};
  for (uint32_t x = 0; x < table.size.x; ++x) {
    const double theta = std::acos(share_of(x, table.size.x));
    std::array<Ways, 3> forward;
    for (size_t p = 0; p < forward.size(); ++p) forward[p] = forward_azimuthal_ways(p, fibre, theta);
    for (uint32_t y = 0; y < table.size.y; ++y) {
      fibre.absorption = absorption_of(y, table.size.y);
      const FibreAverages means = fibre_averages(fibre, shapes, theta);
      const auto mean = [&](size_t p) { return sum_of(forward[p], fibre.absorption); };
      texel(table, x, y, 0) = packed({means.forward, means.back, mean(0), mean(1)});
      texel(table, x, y, 1) =
          packed({mean(2), by_shift(means.forward_shift), by_shift(means.back_shift), 0.0});
      texel(table, x, y, 2) = packed({means.forward_width / width, means.back_width / width, 0.0, 0.0});
    }
  }
  return table;
}

}  // namespace strandcast::scatter
