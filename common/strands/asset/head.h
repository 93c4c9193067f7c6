// The head of an asset as numbers: triangles in the order of a walk over the mesh, vertices in the order in
// which the walk meets them, each by the parallelogram across an edge, and octahedral normals. Pure
// functions, any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

/// Returns the mesh with vertices and triangles in the order in which they are sent, positions on the lattice
/// of kHeadStepBits and normals that its code holds exactly. One beyond kMaxMeshExtentM comes back unchanged.
Mesh as_sent(const Mesh& mesh);

namespace asset {

/// Appends a mesh with triangles. Returns false, having appended nothing, where it is none of as_sent().
bool append_head(const Mesh& mesh, std::vector<std::byte>& destination);

struct HeadCounts {
  uint32_t vertices = 0, triangles = 0;
};
/// Reads what append_head() wrote, from untrusted bytes. BadInput where they are damaged.
Status read_head(std::span<const std::byte> source, const HeadCounts& counts, Mesh& mesh);

}  // namespace asset
}  // namespace strandcast
