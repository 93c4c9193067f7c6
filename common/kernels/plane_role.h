// PlaneRole, TableRole: the planes of strands, and the tables that they look things up in, by what kernels
// call them. Alone, for files that are compiled for one instruction set (lane_kernel.h).
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
  RodAxis,
  PlaceBefore,
  RestDensity
};
inline constexpr size_t kPlaneRoleCount = 10;

/// What kernels call the tables.
enum class TableRole : uint32_t { Field, Volume, Body };
inline constexpr size_t kTableRoleCount = 3;

}  // namespace strandcast
