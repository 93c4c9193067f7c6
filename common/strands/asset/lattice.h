// Lattices of an asset: coordinates as whole steps of a power of two of a metre, which floats hold exactly.
// What a scene shows once is rounded to them where it is loaded, so that server and viewers have equal bits.
// Pure functions, any thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

#include "common/strands/scene_asset.h"

namespace strandcast {

inline constexpr uint32_t kRestStepBits = 17;  // rest positions: 2^-17 m, 8 micrometres, a tenth of a hair
inline constexpr uint32_t kHeadStepBits = 14;  // the head's vertices: 2^-14 m, 61 micrometres

namespace asset {

inline constexpr int32_t kMaxStep = 1 << 27;  // of a coordinate
inline constexpr uint32_t kMaxStepBits = 40;

/// Points as whole steps of 2^-step_bits m, each coordinate within kMaxStep.
struct LatticePoints {
  uint32_t step_bits = 0;
  std::vector<glm::ivec3> point;
};

/// Returns the coarsest lattice that holds the points bit for bit; nothing where none of these does.
std::optional<LatticePoints> to_lattice(std::span<const glm::vec3> points_m);
std::vector<glm::vec3> to_metres(const LatticePoints& points);
/// Returns whole steps of 2^-step_bits m near a point.
glm::vec3 rounded(const glm::vec3& point_m, uint32_t step_bits);

}  // namespace asset

/// Rounds every coordinate to whole steps of 2^-step_bits m.
void round_to_lattice(std::span<glm::vec3> points_m, uint32_t step_bits);

}  // namespace strandcast
