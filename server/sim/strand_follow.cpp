#include "server/sim/strand_follow.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/base/worker_pool.h"
#include "server/sim/shortest_turn.h"

namespace strandcast {
namespace {

constexpr float kShortestM = 1e-9f;
/// Vertices that a worker takes at a time.
constexpr uint32_t kVerticesPerRange = 8'192;

glm::vec3 direction_of(const glm::vec3& v) {
  const float length = glm::length(v);
  return length > kShortestM ? v / length : glm::vec3(0.0f);
}

}  // namespace

bool can_follow(const Groom& groom) {
  for (uint32_t s = 0; s < groom.strand_count(); ++s)
    if (groom.pinned[groom.offset[s + 1] - 1] != 0) return false;
  return groom.strand_count() > 0;
}

uint32_t guide_count(uint32_t strand_count, double share) {
  const auto count = static_cast<uint32_t>(std::ceil(share * strand_count));
  return std::clamp(count, 1u, std::max(1u, strand_count));
}

StrandFollow::StrandFollow(const Groom& groom, uint32_t guide_count)
    : strand_count_(groom.strand_count()),
      vertex_count_(groom.uniform_vertex_count()),
      guide_count_(std::min(guide_count, strand_count_)) {
  CHECK(guide_count_ > 0 && vertex_count_ > 0);
  while (pinned_count_ < vertex_count_ && groom.pinned[pinned_count_] != 0) ++pinned_count_;
  std::vector<glm::vec3> rest(size_t{strand_count_} * vertex_count_);
  for (uint32_t s = 0; s < strand_count_; ++s)
    for (uint32_t v = 0; v < vertex_count_; ++v)
      rest[size_t{v} * strand_count_ + s] = groom.rest_position_m[groom.offset[s] + v];
  guides_ = choose_guides(rest, vertex_count_, guide_count_);
  const uint32_t follower_count = strand_count_ - guide_count_;
  pinned_in_head_m_.resize(size_t{pinned_count_} * follower_count);
  own_segment_m_.resize(size_t{vertex_count_} * follower_count);
  guides_direction_.resize(own_segment_m_.size());
  for (uint32_t v = 0; v < vertex_count_; ++v) {
    const glm::vec3* here = rest.data() + size_t{v} * strand_count_;
    for (uint32_t f = 0; f < follower_count; ++f) {
      const size_t i = size_t{v} * follower_count + f;
      if (v < pinned_count_) pinned_in_head_m_[i] = here[guide_count_ + f];
      if (v == 0) continue;
      const glm::vec3* before = here - strand_count_;
      own_segment_m_[i] = here[guide_count_ + f] - before[guide_count_ + f];
      glm::vec3 mean(0.0f);
      for (size_t g = 0; g < kGuidesOfStrand; ++g) {
        const uint32_t guide = guides_[f].strand[g];
        mean += guides_[f].weight[g] * (here[guide] - before[guide]);
      }
      guides_direction_[i] = direction_of(mean);
    }
  }
}

glm::vec3 StrandFollow::groomed_in_head_m(size_t follower, size_t vertex) const {
  const size_t follower_count = guides_.size();
  const size_t last_pinned = std::min<size_t>(vertex, pinned_count_ - 1);
  glm::vec3 place = pinned_in_head_m_[last_pinned * follower_count + follower];
  for (size_t v = last_pinned + 1; v <= vertex; ++v) place += own_segment_m_[v * follower_count + follower];
  return place;
}

void StrandFollow::follow(std::span<const glm::vec3> guides_in_head_m, std::span<glm::vec3> all_in_head_m,
                          const FollowedSkin& skin) const {
  CHECK(guides_in_head_m.size() == size_t{guide_count_} * vertex_count_ &&
        all_in_head_m.size() == size_t{strand_count_} * vertex_count_);
  for (size_t v = 0; v < vertex_count_; ++v)
    std::copy_n(guides_in_head_m.data() + v * guide_count_, guide_count_,
                all_in_head_m.data() + v * strand_count_);
  const size_t grain = std::max(1u, kVerticesPerRange / vertex_count_);
  shared_workers().at(Priority::Simulation).for_ranges(guides_.size(), grain, [&](size_t begin, size_t end) {
    follow_some(guides_in_head_m.data(), all_in_head_m.data(), begin, end, skin);
  });
}

void StrandFollow::follow_some(const glm::vec3* guides_in_head_m, glm::vec3* all_in_head_m, size_t begin,
                               size_t end, const FollowedSkin& skin) const {
  const size_t follower_count = guides_.size();
  const bool has_skin = skin.exists();
  std::vector<float> room_m(has_skin ? end - begin : 0, 0.0f);
  for (size_t v = 0; v < vertex_count_; ++v) {
    glm::vec3* out = all_in_head_m + v * strand_count_ + guide_count_;
    if (v < pinned_count_) {
      const glm::vec3* pinned = pinned_in_head_m_.data() + v * follower_count;
      std::copy(pinned + begin, pinned + end, out + begin);
      continue;
    }
    const glm::vec3* of_guides = guides_in_head_m + v * guide_count_;
    const glm::vec3* before = of_guides - guide_count_;
    const glm::vec3* own = own_segment_m_.data() + v * follower_count;
    const glm::vec3* at_rest = guides_direction_.data() + v * follower_count;
    for (size_t f = begin; f < end; ++f) {
      glm::vec3 mean(0.0f);
      for (size_t g = 0; g < kGuidesOfStrand; ++g) {
        const uint32_t guide = guides_[f].strand[g];
        mean += guides_[f].weight[g] * (of_guides[guide] - before[guide]);
      }
      const glm::vec3& start = (out - strand_count_)[f];
      out[f] = start + shortest_turn(own[f], at_rest[f], direction_of(mean));
      if (has_skin && skin.may_touch(out[f], glm::length(own[f]), room_m[f - begin]))
        out[f] = skin.turned_out({start, out[f], groomed_in_head_m(f, v - 1), groomed_in_head_m(f, v)});
    }
  }
}

void StrandFollow::blend(std::span<const glm::vec3> of_guides, std::span<glm::vec3> of_all) const {
  CHECK(of_guides.size() == size_t{guide_count_} * vertex_count_ &&
        of_all.size() == size_t{strand_count_} * vertex_count_);
  for (size_t v = 0; v < vertex_count_; ++v) {
    const glm::vec3* from = of_guides.data() + v * guide_count_;
    glm::vec3* to = of_all.data() + v * strand_count_;
    std::copy_n(from, guide_count_, to);
    for (size_t f = 0; f < guides_.size(); ++f) {
      glm::vec3 mean(0.0f);
      for (size_t g = 0; g < kGuidesOfStrand; ++g) mean += guides_[f].weight[g] * from[guides_[f].strand[g]];
      to[guide_count_ + f] = mean;
    }
  }
}

uint64_t StrandFollow::size_bytes() const {
  return guides_.size() * sizeof(StrandGuides) +
         (pinned_in_head_m_.size() + own_segment_m_.size() + guides_direction_.size()) * sizeof(glm::vec3);
}

}  // namespace strandcast
