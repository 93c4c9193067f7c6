// SceneAsset: what a viewer needs once: strand topology, rest shape, follower triangles and head mesh.
// Encoded as a packed byte layout under zstd (proto/WIRE.md). Decodes untrusted input.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/strands/strand_limits.h"

namespace strandcast {

inline constexpr uint32_t kMaxTrianglesPerStrand = 4;
inline constexpr uint32_t kMaxMeshVertices = 3 * kMaxMeshTriangles;

/// Three key strands between which followers are interpolated.
using RootTriangle = glm::uvec3;

struct HeadForm;

/// A triangle mesh: the head that is drawn under the hair, or the scalp that it grows on.
struct Mesh {
  std::vector<glm::vec3> position_m;               // (vertex_count) head space
  std::vector<glm::vec3> normal;                   // (vertex_count) unit, outwards
  std::vector<glm::uvec3> triangle;                // (triangle_count) counter-clockwise seen from outside
  std::shared_ptr<const HeadForm> form = nullptr;  // of the built-in head: what it was made of
};

struct SceneAsset {
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;  // per strand
  std::vector<glm::vec3>
      rest_position_m;  // (vertex_count x strand_count) vertex-major, strand fastest, head space
  std::vector<RootTriangle> triangle;  // key strands between which followers are drawn
  Mesh head;                           // may be empty
};

/// Serialises the payload of an Asset message.
std::vector<std::byte> encode_scene_asset(const SceneAsset& asset);

/// Decodes an untrusted payload. Checks that every number is finite and every index within its array. Errors:
/// BadInput, LimitExceeded.
Result<SceneAsset> decode_scene_asset(std::span<const std::byte> payload);
/// Decodes all but the head, which is left empty; its bytes are not looked at where they can be told apart.
Result<SceneAsset> decode_asset_strands(std::span<const std::byte> payload);

}  // namespace strandcast
