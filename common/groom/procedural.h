// Procedural growth: a groom grown on a scalp mesh, combed away from a middle parting and hanging down. Any
// thread; deterministic: the same mesh and options give the same groom.
#pragma once

#include <cstdint>

#include "common/base/result.h"
#include "common/groom/groom.h"
#include "common/groom/mesh.h"

namespace strandcast {

inline constexpr float kMaxGrownLengthM = 3.0f;
inline constexpr float kMaxCurlRadiusM = 0.05f;
inline constexpr float kMaxCurlTurns = 100.0f;

struct ProceduralGroomOptions {
  uint32_t strand_count = 2000;    // 1..kMaxStrandCount
  uint32_t vertex_count = 16;      // per strand, kMinVertexCount..kMaxVertexCount
  float length_m = 0.28f;          // above 0, at most kMaxGrownLengthM
  float length_variation = 0.12f;  // relative, uniform +-, 0 to below 1
  float curl_radius_m = 0.004f;    // 0 = straight, at most kMaxCurlRadiusM
  float curl_turns = 3.0f;         // along the strand, at most kMaxCurlTurns
  uint32_t seed = 1;
  bool has_bust = false;  // hair that is long enough lies on the built-in head's shoulders
};

/// Grows exactly strand_count strands. Roots are spread evenly by area, but closer along the parting. All
/// segments of a strand have equal length; the first two vertices are pinned. Strands leave along
/// interpolated normals, bend around a sphere fitted to the scalp, and leave the face (+Z) free. Every prefix
/// of the strands covers the scalp evenly. BadInput names the option or the mesh's fault.
Result<Groom> grow_groom(const Mesh& scalp, const ProceduralGroomOptions& options);

}  // namespace strandcast
