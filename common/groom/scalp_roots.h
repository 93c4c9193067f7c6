// Roots spread evenly over a scalp mesh. Any thread; deterministic.
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

/// Where roots stand closer than elsewhere.
struct RootSpread {
  /// Where a point of the scalp is moved to, m, for roots to be even there; empty: they are even on the
  /// scalp.
  std::function<glm::vec3(const glm::vec3& point_m)> moved;
  /// It stretches no area by more than this factor.
  float most_times = 1.0f;
};

/// `count` roots on the triangles of the scalp, no two much nearer than the others, in progressive order.
/// BadInput for a mesh without area, with indices out of range or with coordinates that are not finite.
Result<std::vector<ScalpRoot>> spread_roots(const Mesh& scalp, uint32_t count, uint32_t seed,
                                            const RootSpread& spread = {});

}  // namespace strandcast
