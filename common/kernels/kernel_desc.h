// KernelDesc: which kernel of shaders/sim a strand model runs, and with which constants. Plain data.
#pragma once

#include <compare>
#include <cstdint>
#include <map>
#include <string>
#include <variant>

namespace strandcast {

/// What a model's parameters are to its kernel: uniforms by name, the same in every step. What changes from
/// step to step is in the step's block (step_block.h).
using ModelConstants = std::map<std::string, std::variant<double, uint32_t>>;

struct KernelDesc {
  std::string shader_path;             // below shaders/
  std::map<std::string, int> variant;  // besides COLLIDERS and HAS_TURBULENCE
  ModelConstants constants;
  bool meets_air = true;        // false: it has no HAS_TURBULENCE
  bool meets_colliders = true;  // false: it has no COLLIDERS
  bool is_per_vertex = false;   // a group takes whole strands, an invocation per vertex; else one per strand
  uint32_t scratch_rows = 0;    // per vertex, vec4 that the kernel keeps for itself during a dispatch
  auto operator<=>(const KernelDesc&) const = default;

  /// As the variant says; 0 for an axis that is not named.
  int variant_of(const std::string& axis) const {
    const auto found = variant.find(axis);
    return found == variant.end() ? 0 : found->second;
  }
};

}  // namespace strandcast
