// Spreads roots evenly over a scalp mesh. Any thread; deterministic.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <vector>

#include "common/base/result.h"
#include "common/groom/mesh.h"

namespace strandcast {

struct ScalpRoot {
  glm::vec3 position_m{0.0f};
  glm::vec3 normal{0.0f, 1.0f, 0.0f};  // unit
};

/// Density of roots over the scalp.
struct RootSpread {
  /// Maps a scalp point (m) to the point at which roots are to be evenly spread; empty: they are even on the
  /// scalp itself.
  std::function<glm::vec3(const glm::vec3& point_m)> moved;
  /// Largest factor by which the map stretches an area.
  float most_times = 1.0f;
};

/// Spreads `count` roots over the scalp at about equal distances, in progressive order. BadInput for a mesh
/// without area, with invalid indices or non-finite coordinates.
Result<std::vector<ScalpRoot>> spread_roots(const Mesh& scalp, uint32_t count, uint32_t seed,
                                            const RootSpread& spread = {});

}  // namespace strandcast
