// StrandFollow: where strands are that are not simulated. Each goes with one to three of the first strands,
// its guides: those whose roots and groomed shapes are nearest. Every segment of it turns as theirs do from
// the groom on, so that it is groomed where they are, and keeps its length. What its guides collide with it
// does not enter either. No GL; one thread, with the shared workers.
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
  /// `groom` is uniform, its first `guide_count` strands (at least one) are simulated. Roots that follow the
  /// head stay where it has them.
  StrandFollow(const Groom& groom, uint32_t guide_count);

  /// All strands from the first ones: (vertex_count x guide_count) to (vertex_count x strand_count), both in
  /// head space, the strand fastest. Segments of followers that would end inside of the skin are turned out
  /// of it.
  void follow(std::span<const glm::vec3> guides_in_head_m, std::span<glm::vec3> all_in_head_m,
              const FollowedSkin& skin = {}) const;
  /// The guides' mean of something that they have at each vertex.
  void blend(std::span<const glm::vec3> of_guides, std::span<glm::vec3> of_all) const;

  uint32_t strand_count() const { return strand_count_; }
  uint32_t guide_count() const { return guide_count_; }
  uint32_t vertex_count() const { return vertex_count_; }
  /// Vertices from the root on that go with the head.
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

/// Whether strands of this groom can follow others: no tips are held.
bool can_follow(const Groom& groom);
/// How many of so many strands are simulated for this share: at least one.
uint32_t guide_count(uint32_t strand_count, double share);

}  // namespace strandcast
