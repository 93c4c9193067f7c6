#include "tests/bench/float_strands.h"

#include <algorithm>
#include <cmath>

#include "common/kernels/head_path.h"

namespace strandcast {
namespace {

constexpr float kTiny = 1e-10f;

glm::vec3 shortened(const glm::vec3& value, float longest) {
  const float length = glm::length(value);
  return length > longest ? value * (longest / length) : value;
}

/// Out of the deepest sphere along the sphere of the segment's length; no friction.
glm::vec3 outside(const StepBlock& block, uint32_t collider_count, const glm::vec3& start, glm::vec3 end,
                  float segment) {
  for (uint32_t round = 0; round < std::min(collider_count, 2u); ++round) {
    const glm::vec4* deepest = nullptr;
    float most = 0.0f;
    for (uint32_t c = 0; c < collider_count; ++c) {
      const glm::vec3 outward = end - glm::vec3(block.collider[c]);
      const float inside = block.collider[c].w * block.collider[c].w - glm::dot(outward, outward);
      if (inside > most) {
        most = inside;
        deepest = &block.collider[c];
      }
    }
    if (deepest == nullptr) break;
    const glm::vec3 to_center = glm::vec3(*deepest) - start;
    const float distance = std::max(glm::length(to_center), kTiny);
    const glm::vec3 axis = to_center / distance;
    const float cosine = std::clamp((segment * segment + distance * distance - deepest->w * deepest->w) /
                                        std::max(2.0f * segment * distance, kTiny),
                                    -1.0f, 1.0f);
    const glm::vec3 side = (end - start) - axis * glm::dot(end - start, axis);
    const float sine = std::sqrt(1.0f - cosine * cosine) / std::max(glm::length(side), kTiny);
    end = start + segment * (cosine * axis + sine * side);
  }
  return end;
}

}  // namespace

Status FloatStrands::load(const Groom& groom, const glm::dquat& world_from_head_rotation) {
  ASSIGN_OR_RETURN(layout_, make_strand_layout(groom));
  if (layout_.pinned_tail_count > 0) return make_error(ErrorCode::Unsupported, "free tips only");
  previous_rotation_ = limited_rotation(world_from_head_rotation);
  state_.position_m.clear();
  for (const glm::vec4& rest : layout_.rest)
    state_.position_m.emplace_back(previous_rotation_ * glm::dvec3(rest));
  state_.velocity_mps.assign(layout_.size(), glm::vec3(0.0f));
  return {};
}

void FloatStrands::rebase(const glm::dquat& world_from_head_rotation) {
  const glm::dquat turn = limited_rotation(world_from_head_rotation) * glm::conjugate(previous_rotation_);
  for (auto* values : {&state_.position_m, &state_.velocity_mps})
    for (glm::vec3& value : *values) value = glm::vec3(turn * glm::dvec3(value));
  previous_rotation_ = limited_rotation(world_from_head_rotation);
}

void FloatStrands::substep(const StepInput& input) {
  const StepBlock block =
      make_step_block(input, parameters_, layout_.counts(), HeadPath::at_rest(previous_rotation_));
  previous_rotation_ = limited_rotation(input.world_from_head_rotation);
  const glm::mat3 rotation = glm::mat3(glm::mat3_cast(previous_rotation_));
  const auto collider_count =
      static_cast<uint32_t>(std::min<size_t>(input.colliders.size(), kMaxSphereColliders));
  for (uint32_t strand = 0; strand < layout_.strand_count; ++strand) {
    step_strand(block, rotation, collider_count, strand);
  }
}

void FloatStrands::step_strand(const StepBlock& block, const glm::mat3& rotation, uint32_t collider_count,
                               uint32_t strand) {
  const glm::vec3 head_velocity(block.head_velocity);
  const float h = block.head_velocity.w;
  const float per_step = block.push.w;
  const float limit = block.style.w;
  glm::vec3 start(0.0f);
  glm::vec3 waiting(0.0f);
  for (uint32_t i = 0; i < layout_.vertex_count; ++i) {
    const size_t at = layout_.index(i, strand);
    glm::vec3& position = state_.position_m[at];
    glm::vec3& velocity = state_.velocity_mps[at];
    const glm::vec3 target = rotation * glm::vec3(layout_.rest[at]);
    if (i < layout_.pinned_root_count) {
      velocity = shortened((target - position) * per_step, limit) + head_velocity;
      position = start = target;
      continue;
    }
    const float from_tip = 1.0f - layout_.arc[at];
    const float pull = h * block.style.x * (block.style.y + (1.0f - block.style.y) * from_tip * from_tip);
    const glm::vec3 moved = (velocity - head_velocity + glm::vec3(block.push) + pull * (target - position)) /
                            (1.0f + h * (block.contact.y + pull));
    const glm::vec3 predicted = position + h * shortened(moved, limit);
    const glm::vec3 along = predicted - start;
    const float segment = layout_.rest[at].w;
    const glm::vec3 free_end = start + along * (segment / std::max(glm::length(along), kTiny));
    const glm::vec3 end = outside(block, collider_count, start, free_end, segment);
    const glm::vec3 segment_vector = free_end - start;
    const float thrust = std::max(glm::dot(free_end - predicted, segment_vector), 0.0f) /
                         std::max(glm::dot(segment_vector, segment_vector), kTiny);
    const glm::vec3 correction = free_end - predicted - block.contact.z * thrust * segment_vector;
    if (i > layout_.pinned_root_count) {
      state_.velocity_mps[layout_.index(i - 1, strand)] =
          shortened(waiting - block.style.z * per_step * correction, limit) + head_velocity;
    }
    waiting = (end - position) * per_step;
    position = start = end;
  }
  state_.velocity_mps[layout_.index(layout_.vertex_count - 1, strand)] =
      shortened(waiting, limit) + head_velocity;
}

void FloatStrands::read(SolverState& state) {
  state = state_;
}
void FloatStrands::write(const SolverState& state) {
  state_ = state;
}
uint64_t FloatStrands::memory_bytes() const {
  return layout_.size() * (sizeof(glm::vec4) + sizeof(float) + 2 * sizeof(glm::vec3));
}

}  // namespace strandcast
