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

/// Exactly strand_count strands, roots spread evenly over the scalp by area but closer along the parting, all
/// segments of a strand equally long, the first two vertices pinned. Strands leave along the interpolated
/// normals, bend over a sphere fitted to the scalp without entering it and leave the face (+Z) free. Strands
/// come in an order whose prefixes cover the scalp alike. BadInput names the option or the fault of the mesh.
Result<Groom> grow_groom(const Mesh& scalp, const ProceduralGroomOptions& options);

}  // namespace strandcast
