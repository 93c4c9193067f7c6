// Groom: strands at rest in head space, as a structure of arrays. Plain data, immutable after loading.
// Loaders are in groom_file.h, tfx_loader.h and hair_loader.h, growth in procedural.h, resampling in
// resample.h.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/strands/scene_asset.h"
#include "common/strands/strand_limits.h"

namespace strandcast {

// Limits of groom files, besides those of all strands; checked before anything is allocated.
inline constexpr uint32_t kMaxSourceVertexCount = 4'096;  // per strand in a file, before resampling
inline constexpr uint64_t kMaxGroomFileBytes = 512ull << 20;

/// Which vertices of a strand follow the head exactly; all others are simulated.
enum class Pinning { Root, RootPair, BothEnds };  // vertex 0 | vertices 0 and 1 | 0, 1 and the last two

struct Groom {
  std::string name;
  float file_unit_m = 1.0f;                // metres per unit of the file it came from
  std::vector<uint32_t> offset;            // (strand_count + 1) first vertex of each strand
  std::vector<glm::vec3> rest_position_m;  // (vertex total) head space, root first
  std::vector<uint8_t> pinned;             // (vertex total) 1 = follows the head
  std::vector<glm::vec2> root_uv;          // (strand_count) or empty

  uint32_t strand_count() const { return offset.empty() ? 0u : static_cast<uint32_t>(offset.size() - 1); }
  uint32_t vertex_count(uint32_t strand_index) const {
    return offset[strand_index + 1] - offset[strand_index];
  }
  /// Returns the number of vertices per strand if all strands have the same, else 0. The simulation needs a
  /// uniform groom.
  uint32_t uniform_vertex_count() const;
  /// Returns the arc length of one strand in metres.
  float length_m(uint32_t strand_index) const;
};

/// Checks sizes, limits, and coordinates within kMaxGroomExtentM. Every strand must have at least 2 vertices,
/// of which vertex 0 is pinned. BadInput and LimitExceeded name the strand and vertex.
Status validate(const Groom& groom);

/// Returns triangles of neighbouring roots, at most about 2 per strand, also across partings. Deterministic.
/// Strands in no triangle are still drawn themselves.
std::vector<RootTriangle> make_root_triangles(const Groom& groom);

/// Returns an order of strands such that every prefix covers the head evenly and is a valid subset.
std::vector<uint32_t> make_prefix_order(const Groom& groom);

/// Returns the groom with exactly the given vertices of every strand pinned.
Groom with_pinning(Groom groom, Pinning pinning);

/// Returns the groom with its strands in `order`, which is a permutation of 0..strand_count-1.
Groom reorder(const Groom& groom, const std::vector<uint32_t>& order);

}  // namespace strandcast
