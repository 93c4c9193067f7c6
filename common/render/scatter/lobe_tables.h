// Lookup tables for the shaders, computed from the double-precision fibre; half floats in the shape that
// shaders/shared/lobe_tables.h states. Pure functions, any thread, some milliseconds each.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "common/render/scatter/marschner.h"

namespace strandcast::scatter {

/// Table of (depth x height x width x 4) half floats.
struct LookupTable {
  glm::uvec3 size{0};
  std::vector<uint64_t> texels;
};

LookupTable make_longitudinal_table(const std::array<LobeShape, 3>& shapes);
LookupTable make_azimuthal_table(const CausticTerms& caustic);
/// Makes the table of fibre averages; shifts and widths are relative to those of `shapes[0]`.
LookupTable make_average_table(const std::array<LobeShape, 3>& shapes, const CausticTerms& caustic);

}  // namespace strandcast::scatter
