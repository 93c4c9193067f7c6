#include "client/replay/strand_fill.h"

#include <glm/gtc/quaternion.hpp>

#include "common/groom/point_tree.h"

namespace strandcast {
namespace {

/// Nearer than this two roots are one place, m.
constexpr float kSameRootM = 1e-4f;
/// A shorter segment has no direction, m.
constexpr float kShortestM = 1e-7f;

/// The shortest turn from one direction to another; none when either has no length.
glm::quat turn_between(const glm::vec3& from, const glm::vec3& to) {
  const float scale = glm::length(from) * glm::length(to);
  if (!(scale > kShortestM * kShortestM)) return {1.0f, 0.0f, 0.0f, 0.0f};
  const glm::vec3 axis = glm::cross(from, to) / scale;
  const glm::quat turn(1.0f + glm::dot(from, to) / scale, axis.x, axis.y, axis.z);
  constexpr float kLeastSquare = 1e-6f;  // straight back: any axis would do, none is as good
  const float square = glm::dot(turn, turn);
  return square > kLeastSquare ? turn * (1.0f / std::sqrt(square)) : glm::quat(1.0f, 0.0f, 0.0f, 0.0f);
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
    const auto nearest = tree.nearest(rest_in_head_m_[s], kGuides);
    for (size_t i = 0; i < nearest.size(); ++i) {
      guides.strand[i] = nearest[i].index;
      guides.weight[i] = 1.0f / (nearest[i].distance_squared + kSameRootM * kSameRootM);
      sum += guides.weight[i];
    }
    for (float& weight : guides.weight) weight /= sum;
  }
}

std::vector<glm::vec3> StrandFill::positions(const Snapshot& snapshot) {
  const std::vector<glm::vec3> sent = positions_in_head(snapshot);
  const uint32_t sent_count = snapshot.strand_count;
  if (sent_count >= strand_count_ || snapshot.vertex_count != vertex_count_) return sent;
  choose_guides(sent_count);
  std::vector<glm::vec3> all(rest_in_head_m_.size());
  std::vector<glm::quat> turn(sent_count);
  for (size_t v = 0; v < vertex_count_; ++v) {
    const glm::vec3* rest = rest_in_head_m_.data() + v * strand_count_;
    const glm::vec3* row = sent.data() + v * sent_count;
    glm::vec3* out = all.data() + v * strand_count_;
    for (uint32_t s = 0; s < sent_count; ++s) {
      out[s] = row[s];
      if (v > 0) turn[s] = turn_between(rest[s] - (rest - strand_count_)[s], row[s] - (row - sent_count)[s]);
    }
    for (uint32_t s = sent_count; s < strand_count_; ++s) {
      const Guides& guides = guides_[s - sent_count];
      glm::vec3 moved(0.0f);
      glm::quat turned(0.0f, 0.0f, 0.0f, 0.0f);
      for (size_t i = 0; i < kGuides; ++i) {
        const uint32_t guide = guides.strand[i];
        if (v == 0) moved += guides.weight[i] * (row[guide] - rest[guide]);
        // Of the two signs of a turn the one on the same side as the first guide's.
        const float side = glm::dot(turn[guide], turn[guides.strand[0]]) < 0.0f ? -1.0f : 1.0f;
        turned = turned + turn[guide] * (side * guides.weight[i]);
      }
      out[s] =
          v == 0 ? rest[s] + moved
                 : (out - strand_count_)[s] + glm::normalize(turned) * (rest[s] - (rest - strand_count_)[s]);
    }
  }
  return all;
}

}  // namespace strandcast
