#include "server/sim/vertex_follow.h"

#include <algorithm>

#include "common/base/check.h"
#include "common/base/worker_pool.h"
#include "server/sim/shortest_turn.h"

namespace strandcast {
namespace {

constexpr float kShortestEdgeM = 1e-9f;
/// Vertices that a worker takes at a time.
constexpr uint32_t kFollowedVerticesPerRange = 8'192;

}  // namespace

// From the tip to the root, so that only the first free segment may be a shorter one.
VertexFollow::VertexFollow(const Groom& groom, uint32_t stride)
    : strand_count_(groom.strand_count()), vertex_count_(groom.uniform_vertex_count()) {
  CHECK(stride > 0 && vertex_count_ > 0);
  uint32_t pinned = 1;
  while (pinned < vertex_count_ && groom.pinned[pinned] != 0) ++pinned;
  for (uint32_t v = vertex_count_ - 1; v >= pinned; v -= std::min(v, stride)) kept_.push_back(v);
  for (uint32_t v = pinned; v-- > 0;) kept_.push_back(v);
  std::reverse(kept_.begin(), kept_.end());
  if (kept_.size() == vertex_count_) return;
  rest_way_m_.resize(size_t{vertex_count_} * strand_count_);
  for (uint32_t s = 0; s < strand_count_; ++s) {
    const glm::vec3* rest = groom.rest_position_m.data() + groom.offset[s];
    for (size_t k = 1; k < kept_.size(); ++k)
      for (uint32_t v = kept_[k - 1] + 1; v <= kept_[k]; ++v)
        rest_way_m_[size_t{v} * strand_count_ + s] = rest[v] - rest[kept_[k - 1]];
  }
}

Groom VertexFollow::simulated(const Groom& groom) const {
  CHECK(groom.strand_count() == strand_count_ && groom.uniform_vertex_count() == vertex_count_);
  if (kept_.size() == vertex_count_) return groom;
  Groom fewer = groom;
  fewer.rest_position_m.clear();
  fewer.pinned.clear();
  for (uint32_t s = 0; s < strand_count_; ++s) {
    fewer.offset[s] = s * static_cast<uint32_t>(kept_.size());
    for (const uint32_t v : kept_) {
      fewer.rest_position_m.push_back(groom.rest_position_m[groom.offset[s] + v]);
      fewer.pinned.push_back(groom.pinned[groom.offset[s] + v]);
    }
  }
  fewer.offset[strand_count_] = static_cast<uint32_t>(fewer.rest_position_m.size());
  return fewer;
}

void VertexFollow::take(std::span<const glm::vec3> of_all, std::span<glm::vec3> of_kept) const {
  CHECK(of_kept.size() == kept_size() && of_all.size() == size_t{vertex_count_} * strand_count_);
  for (size_t k = 0; k < kept_.size(); ++k)
    std::copy_n(of_all.data() + size_t{kept_[k]} * strand_count_, strand_count_,
                of_kept.data() + k * strand_count_);
}

void VertexFollow::put(std::span<const glm::vec3> of_kept, std::span<glm::vec3> of_all) const {
  CHECK(of_kept.size() == kept_size() && of_all.size() == size_t{vertex_count_} * strand_count_);
  for (size_t k = 0; k < kept_.size(); ++k)
    std::copy_n(of_kept.data() + k * strand_count_, strand_count_,
                of_all.data() + size_t{kept_[k]} * strand_count_);
}

void VertexFollow::follow(std::span<const glm::vec3> kept_in_head_m,
                          std::span<glm::vec3> all_in_head_m) const {
  put(kept_in_head_m, all_in_head_m);
  if (kept_.size() == vertex_count_) return;
  const size_t grain = std::max(1u, kFollowedVerticesPerRange / vertex_count_);
  shared_workers().at(Priority::Simulation).for_ranges(strand_count_, grain, [&](size_t begin, size_t end) {
    follow_some(kept_in_head_m.data(), all_in_head_m.data(), begin, end);
  });
}

void VertexFollow::follow_some(const glm::vec3* kept_in_head_m, glm::vec3* all_in_head_m, size_t begin,
                               size_t end) const {
  for (size_t k = 1; k < kept_.size(); ++k) {
    const glm::vec3* from = kept_in_head_m + (k - 1) * strand_count_;
    const glm::vec3* to = from + strand_count_;
    const glm::vec3* whole = rest_way_m_.data() + size_t{kept_[k]} * strand_count_;
    for (uint32_t v = kept_[k - 1] + 1; v < kept_[k]; ++v) {
      const glm::vec3* part = rest_way_m_.data() + size_t{v} * strand_count_;
      glm::vec3* out = all_in_head_m + size_t{v} * strand_count_;
      for (size_t s = begin; s < end; ++s) {
        const glm::vec3 way = to[s] - from[s];
        const float length = glm::length(way), rest_length = glm::length(whole[s]);
        // Two that are in one place, now or in the groom, have no way between them.
        if (length < kShortestEdgeM || rest_length < kShortestEdgeM) {
          out[s] = from[s] +
                   way * (static_cast<float>(v - kept_[k - 1]) / static_cast<float>(kept_[k] - kept_[k - 1]));
          continue;
        }
        out[s] =
            from[s] + shortest_turn(part[s], whole[s] / rest_length, way / length) * (length / rest_length);
      }
    }
  }
}

void VertexFollow::blend(std::span<const glm::vec3> of_kept, std::span<glm::vec3> of_all) const {
  put(of_kept, of_all);
  for (size_t k = 1; k < kept_.size(); ++k) {
    const glm::vec3* from = of_kept.data() + (k - 1) * strand_count_;
    for (uint32_t v = kept_[k - 1] + 1; v < kept_[k]; ++v) {
      const float share = static_cast<float>(v - kept_[k - 1]) / static_cast<float>(kept_[k] - kept_[k - 1]);
      for (size_t s = 0; s < strand_count_; ++s)
        of_all[size_t{v} * strand_count_ + s] = glm::mix(from[s], from[strand_count_ + s], share);
    }
  }
}

uint64_t VertexFollow::size_bytes() const {
  return rest_way_m_.size() * sizeof(glm::vec3) + kept_.size() * sizeof(uint32_t);
}

}  // namespace strandcast
