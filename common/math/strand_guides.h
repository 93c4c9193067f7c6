// StrandGuides: which strands another one goes with that is not simulated, or was not sent: three whose roots
// and shapes at rest are near. Pure function, any thread.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace strandcast {

inline constexpr uint32_t kGuidesOfStrand = 3;

struct StrandGuides {
  std::array<uint32_t, kGuidesOfStrand> strand{};
  std::array<float, kGuidesOfStrand> weight{};  // sum 1; 0 where there are fewer guides
};

/// Guides among the first `guide_count` strands (at least one) for each of the others, from strand
/// `guide_count` on. `rest_m`: (vertex_count x strand_count), strand fastest, one space.
std::vector<StrandGuides> choose_guides(std::span<const glm::vec3> rest_m, uint32_t vertex_count,
                                        uint32_t guide_count);

}  // namespace strandcast
