// Lookup tables for the shaders, from the double-precision fibre: half floats in the shape that
// shaders/shared/lobe_tables.h states. Pure functions, any thread, some milliseconds.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "common/render/scatter/marschner.h"

namespace strandcast::scatter {

/// (depth x height x width x 4) half floats.
struct LookupTable {
  glm::uvec3 size{0};
  std::vector<uint64_t> texels;
};

LookupTable make_longitudinal_table(const std::array<LobeShape, 3>& shapes);
LookupTable make_azimuthal_table(const CausticTerms& caustic);
/// Shifts and widths relative to those of `shapes[0]`.
LookupTable make_average_table(const std::array<LobeShape, 3>& shapes, const CausticTerms& caustic);

}  // namespace strandcast::scatter
