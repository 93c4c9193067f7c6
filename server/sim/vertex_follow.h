// VertexFollow: computes the vertices of strands that are not simulated. In each strand the pinned vertices,
// the tip and every `stride`-th vertex between are simulated, as a shorter strand. The others lie between two
// simulated ones as in the groom, rotated and stretched with the chord between them. No GL; one thread, with
// the shared workers.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "common/groom/groom.h"

namespace strandcast {

class VertexFollow {
 public:
  /// Chooses the simulated vertices. `groom` must be uniform; `stride` is at least 1, which simulates all.
  VertexFollow(const Groom& groom, uint32_t stride);

  /// Returns the groom with the simulated vertices only.
  Groom simulated(const Groom& groom) const;
  /// Computes all vertices from the simulated ones: (kept x strand_count) to (vertex_count x strand_count),
  /// both in head space, strand fastest. Simulated vertices keep their bits.
  void follow(std::span<const glm::vec3> kept_in_head_m, std::span<glm::vec3> all_in_head_m) const;
  /// Computes a quantity at all vertices by linear interpolation between simulated ones.
  void blend(std::span<const glm::vec3> of_kept, std::span<glm::vec3> of_all) const;
  /// Copy the simulated vertices' values out of those of all vertices, and back; other vertices keep theirs.
  void take(std::span<const glm::vec3> of_all, std::span<glm::vec3> of_kept) const;
  void put(std::span<const glm::vec3> of_kept, std::span<glm::vec3> of_all) const;

  uint32_t strand_count() const { return strand_count_; }
  uint32_t vertex_count() const { return vertex_count_; }
  /// Returns the indices of the simulated vertices, from root to tip.
  const std::vector<uint32_t>& kept() const { return kept_; }
  size_t kept_size() const { return kept_.size() * strand_count_; }
  uint64_t size_bytes() const;

 private:
  void follow_some(const glm::vec3* kept_in_head_m, glm::vec3* all_in_head_m, size_t begin, size_t end) const;

  uint32_t strand_count_ = 0;
  uint32_t vertex_count_ = 0;
  std::vector<uint32_t> kept_;
  // (vertex_count x strand_count), head space, of the groom: from the simulated vertex before; of those that
  // are simulated the whole way from the one before.
  std::vector<glm::vec3> rest_way_m_;
};

}  // namespace strandcast
