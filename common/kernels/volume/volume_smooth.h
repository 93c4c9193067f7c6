// The second half of a hair volume on processors: sums at nodes are smoothed by [1 2 1] / 4 along each axis,
// divided, and the quotient smoothed alike, so that what interpolation takes out of the volume is what the
// sums put in (momentum is kept). Rows of nodes that nothing is in are skipped. Any thread; the same bits
// from every instruction set.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>

#include "common/simd/variants.h"

namespace strandcast {

/// What of a node's four numbers is smoothed.
enum class VolumeParts { All, Velocity };

/// One of the two passes that smooth a volume: along x and y from `from` to `to`, or along z.
struct VolumeSmooth {
  glm::uvec3 nodes{0u};
  VolumeParts parts = VolumeParts::All;
  const glm::vec4* from = nullptr;     // (nodes)
  const uint8_t* from_rows = nullptr;  // (nodes.z x nodes.y)
  glm::vec4* to = nullptr;
  uint8_t* to_rows = nullptr;
  uint32_t begin = 0;  // layers of nodes
  uint32_t end = 0;
};
void smooth_in_layers(simd::InstructionSet set, const VolumeSmooth& work);
void smooth_across_layers(simd::InstructionSet set, const VolumeSmooth& work);

/// Sums to mean velocity and density, in place.
struct VolumeDivide {
  glm::uvec3 nodes{0u};
  float per_cell_m3 = 1.0f;  // 1 / volume of a cell
  glm::vec4* values = nullptr;
  const uint8_t* rows = nullptr;
  uint32_t begin = 0;  // layers of nodes
  uint32_t end = 0;
};
void divide_sums(simd::InstructionSet set, const VolumeDivide& work);

}  // namespace strandcast
