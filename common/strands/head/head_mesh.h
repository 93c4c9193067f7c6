// The built-in head as a mesh, and normals of meshes. Any thread.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "common/strands/scene_asset.h"

namespace strandcast {

/// Makes the built-in head (cranium, face, ears, neck) with this cranium radius; the origin is that of head
/// space. The first call in a process takes some 40 ms.
Mesh make_head(float radius_m);

/// Returns area-weighted unit normals of the vertices; +Y for a vertex without triangles.
std::vector<glm::vec3> compute_normals(const std::vector<glm::vec3>& position_m,
                                       const std::vector<glm::uvec3>& triangle);

}  // namespace strandcast
