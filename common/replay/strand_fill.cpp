#include "common/replay/strand_fill.h"

#include <algorithm>

#include "common/math/point_tree.h"

namespace strandcast {
namespace {

/// Nearer than this two roots are one place, m.
constexpr float kSameRootM = 1e-4f;
/// How much of what sets a strand's rest shape apart from its guides' it keeps: with 1 hanging hair is
/// frizzy, with 0 it clumps. Median distance to the truth on the built-in scene in motion with 1/4 of the
/// strands: 3.3 mm with 0, 1.8 mm with 0.5, 2.9 mm with 1.
constexpr float kOwnShape = 0.5f;
/// Of so many near roots those guide that fall as the strand does: a tip that is elsewhere from its root by
/// so much counts as a root that is this share of it away. Else hair beside a parting is guided from its
/// other side.
constexpr uint32_t kCandidates = 10;
constexpr float kFallShare = 0.2f;

/// `along` brought to this length; `otherwise`, which has it, when it has no direction.
glm::vec3 with_length(const glm::vec3& along, float length_m, const glm::vec3& otherwise) {
  constexpr float kShortestM = 1e-7f;
  const float now_m = glm::length(along);
  return now_m > kShortestM ? along * (length_m / now_m) : otherwise;
}

}  // namespace

StrandFill::StrandFill(std::span<const glm::vec3> rest_in_head_m, uint32_t vertex_count)
    : strand_count_(vertex_count > 0 ? static_cast<uint32_t>(rest_in_head_m.size() / vertex_count) : 0),
      vertex_count_(vertex_count),
      rest_in_head_m_(rest_in_head_m.begin(), rest_in_head_m.end()) {}

void StrandFill::choose_guides(uint32_t sent_count) {
  if (sent_count == sent_count_) return;
  sent_count_ = sent_count;
  const PointTree tree(std::span<const glm::vec3>(rest_in_head_m_).first(sent_count));
  guides_.assign(strand_count_ - sent_count, {});
  for (uint32_t s = sent_count; s < strand_count_; ++s) {
    Guides& guides = guides_[s - sent_count];
    float sum = 0.0f;
    auto nearest = tree.nearest(rest_in_head_m_[s], kCandidates);
    for (auto& root : nearest) {
      const glm::vec3 apart_m = kFallShare * (fall_m(root.index) - fall_m(s));
      root.distance_squared += glm::dot(apart_m, apart_m);
    }
    std::stable_sort(nearest.begin(), nearest.end(),
                     [](const auto& a, const auto& b) { return a.distance_squared < b.distance_squared; });
    nearest.resize(std::min<size_t>(nearest.size(), kGuides));
    for (size_t i = 0; i < nearest.size(); ++i) {
      guides.strand[i] = nearest[i].index;
      guides.weight[i] = 1.0f / (nearest[i].distance_squared + kSameRootM * kSameRootM);
      sum += guides.weight[i];
    }
    for (float& weight : guides.weight) weight /= sum;
  }
}

glm::vec3 StrandFill::fall_m(uint32_t strand) const {
  const size_t tip = size_t{vertex_count_ - 1} * strand_count_;
  return rest_in_head_m_[tip + strand] - rest_in_head_m_[strand];
}

std::vector<glm::vec3> StrandFill::positions(const Snapshot& snapshot) {
  const std::vector<glm::vec3> sent = positions_in_head(snapshot);
  const uint32_t sent_count = snapshot.strand_count;
  if (sent_count >= strand_count_ || snapshot.vertex_count != vertex_count_) return sent;
  choose_guides(sent_count);
  std::vector<glm::vec3> all(rest_in_head_m_.size());
  for (size_t v = 0; v < vertex_count_; ++v) {
    const glm::vec3* rest = rest_in_head_m_.data() + v * strand_count_;
    glm::vec3* out = all.data() + v * strand_count_;
    std::copy_n(sent.data() + v * sent_count, sent_count, out);
    for (uint32_t s = sent_count; s < strand_count_; ++s) {
      const Guides& guides = guides_[s - sent_count];
      glm::vec3 moved(0.0f);  // the guides' root, or their segment, less where it is at rest
      glm::vec3 guides_rest(0.0f);
      for (size_t i = 0; i < kGuides; ++i) {
        const uint32_t guide = guides.strand[i];
        const float weight = guides.weight[i];
        const glm::vec3 at_rest = v == 0 ? rest[guide] : rest[guide] - (rest - strand_count_)[guide];
        const glm::vec3 now = v == 0 ? out[guide] : out[guide] - (out - strand_count_)[guide];
        moved += weight * (now - at_rest);
        guides_rest += weight * at_rest;
      }
      if (v == 0) {
        out[s] = rest[s] + moved;
        continue;
      }
      const glm::vec3 own = rest[s] - (rest - strand_count_)[s];
      const glm::vec3 along = moved + guides_rest + kOwnShape * (own - guides_rest);
      out[s] = (out - strand_count_)[s] + with_length(along, glm::length(own), own);
    }
  }
  return all;
}

}  // namespace strandcast
