// Root triangles of an asset as numbers: corners by their ranks among the roots near the first one. Exact, in
// any order of triangles and corners. Pure functions, any thread.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/strands/scene_asset.h"

namespace strandcast::asset {

/// Appends triangles whose corners are all among the roots.
void append_triangles(std::span<const RootTriangle> triangles, std::span<const glm::vec3> roots_m,
                      std::vector<std::byte>& destination);

/// Reads what append_triangles() wrote, from untrusted bytes; `triangles` has their number. BadInput where
/// they are damaged.
Status read_triangles(std::span<const std::byte> source, std::span<const glm::vec3> roots_m,
                      std::span<RootTriangle> triangles);

}  // namespace strandcast::asset
