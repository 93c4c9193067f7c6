// StrandFollow: computes the strands that are not simulated. Each follows one to three of the first strands,
// its guides, whose roots and groomed shapes are nearest. Each of its segments rotates as theirs have since
// the groom, so it matches the groom where they do and keeps its length. It stays out of what the guides
// collide with. No GL; one thread, with the shared workers.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "common/groom/groom.h"
#include "common/math/strand_guides.h"
#include "server/sim/followed_skin.h"

namespace strandcast {

class StrandFollow {
 public:
  /// Chooses the guides. `groom` must be uniform; its first `guide_count` strands (at least one) are
  /// simulated. Pinned roots keep their positions on the head.
  StrandFollow(const Groom& groom, uint32_t guide_count);

  /// Computes all strands from the guides: (vertex_count x guide_count) to (vertex_count x strand_count),
  /// both in head space, strand fastest. Segments that would end inside the skin are rotated out of it.
  void follow(std::span<const glm::vec3> guides_in_head_m, std::span<glm::vec3> all_in_head_m,
              const FollowedSkin& skin = {}) const;
  /// Computes a per-vertex quantity of all strands as the weighted mean of their guides'.
  void blend(std::span<const glm::vec3> of_guides, std::span<glm::vec3> of_all) const;

  uint32_t strand_count() const { return strand_count_; }
  uint32_t guide_count() const { return guide_count_; }
  uint32_t vertex_count() const { return vertex_count_; }
  /// Returns the number of vertices, from the root on, that move with the head.
  uint32_t pinned_count() const { return pinned_count_; }
  uint64_t size_bytes() const;

 private:
  void follow_some(const glm::vec3* guides_in_head_m, glm::vec3* all_in_head_m, size_t begin, size_t end,
                   const FollowedSkin& skin) const;
  /// Groomed place of a follower's vertex, head space.
  glm::vec3 groomed_in_head_m(size_t follower, size_t vertex) const;

  uint32_t strand_count_ = 0;
  uint32_t vertex_count_ = 0;
  uint32_t guide_count_ = 0;
  uint32_t pinned_count_ = 1;
  std::vector<StrandGuides> guides_;         // (followers)
  std::vector<glm::vec3> pinned_in_head_m_;  // (pinned_count x followers)
  // (vertex_count x followers), of the segment before the vertex in the groom, head space:
  std::vector<glm::vec3> own_segment_m_;
  std::vector<glm::vec3> guides_direction_;  // of the guides' mean, unit
};

/// Returns whether strands of this groom can follow others: their tips must not be pinned.
bool can_follow(const Groom& groom);
/// Returns how many of `strand_count` strands are simulated for this share: at least one.
uint32_t guide_count(uint32_t strand_count, double share);

}  // namespace strandcast
