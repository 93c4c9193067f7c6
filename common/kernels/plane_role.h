// PlaneRole: the planes of strands by what kernels call them. Alone, for files that are compiled for one
// instruction set (lane_kernel.h).
#pragma once

#include <cstddef>
#include <cstdint>

namespace strandcast {

/// What kernels call the planes (shaders/shared/bindings.h).
enum class PlaneRole : uint32_t {
  Rest,
  Position,
  Velocity,
  Displacement,
  VelocityChange,
  RodEdge,
  RodStrand,
  RodAxis
};
inline constexpr size_t kPlaneRoleCount = 8;

}  // namespace strandcast
