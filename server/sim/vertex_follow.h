// VertexFollow: where the vertices of strands are that are not simulated. Of each strand the vertices that go
// with the head, its tip, and every so many in between are simulated, as a strand of its own; the others lie
// between two of these as in the groom, turned and stretched as the way between the two is. No GL; one
// thread, with the shared workers.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "common/groom/groom.h"

namespace strandcast {

class VertexFollow {
 public:
  /// `groom` is uniform; `stride` is at least 1, which simulates all.
  VertexFollow(const Groom& groom, uint32_t stride);

  /// The groom with the simulated vertices alone.
  Groom simulated(const Groom& groom) const;
  /// All vertices from the simulated ones: (kept x strand_count) to (vertex_count x strand_count), both in
  /// head space, the strand fastest. Simulated ones are where they were, to the last bit.
  void follow(std::span<const glm::vec3> kept_in_head_m, std::span<glm::vec3> all_in_head_m) const;
  /// Something that simulated vertices have, in equal steps from one to the next.
  void blend(std::span<const glm::vec3> of_kept, std::span<glm::vec3> of_all) const;
  /// Of all vertices' something that of the simulated ones, and back: the others keep what they have.
  void take(std::span<const glm::vec3> of_all, std::span<glm::vec3> of_kept) const;
  void put(std::span<const glm::vec3> of_kept, std::span<glm::vec3> of_all) const;

  uint32_t strand_count() const { return strand_count_; }
  uint32_t vertex_count() const { return vertex_count_; }
  /// Which are simulated, from root to tip.
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
