// SceneAsset: what a viewer needs once: strand topology, rest shape, follower triangles and the head mesh.
// Encoded as a packed byte layout under zstd (proto/WIRE.md). Decoding input is untrusted.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/groom/groom.h"
#include "common/groom/mesh.h"

namespace strandcast {

inline constexpr uint32_t kMaxTrianglesPerStrand = 4;
inline constexpr uint32_t kMaxMeshVertices = 3 * kMaxMeshTriangles;

struct SceneAsset {
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;  // per strand
  std::vector<glm::vec3>
      rest_position_m;  // (vertex_count x strand_count) vertex-major, strand fastest, head space
  std::vector<RootTriangle> triangle;  // key strands between which followers are drawn
  Mesh head;                           // may be empty
};

/// From a uniform groom and a head mesh with one normal per vertex.
SceneAsset make_scene_asset(const Groom& groom, Mesh head);

/// Payload of an Asset message.
std::vector<std::byte> encode_scene_asset(const SceneAsset& asset);

/// Untrusted input. BadInput or LimitExceeded: every number is checked to be finite, every index against its
/// array.
Result<SceneAsset> decode_scene_asset(std::span<const std::byte> payload);

}  // namespace strandcast
