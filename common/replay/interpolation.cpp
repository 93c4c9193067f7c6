#include "common/replay/interpolation.h"

#include <algorithm>

#include "common/base/check.h"
#include "common/replay/position_blend.h"

namespace strandcast {
namespace {

const float* coordinates(const PosedStrands& strands) {
  return &strands.position_m.data()->x;
}

bool is_jump(double before, double step, double after) {
  const double all = before + step + after;
  const double largest = std::max({before, step, after});
  return largest > kJumpSteps * (all - largest);
}

template <class Vector>
Vector on_cubic(const Vector& from, const Vector& before, const Vector& step, const Vector& after,
                const CubicTerms& terms) {
  return from + step * terms.blend + (step - before) * terms.bend_before + (after - step) * terms.bend_after;
}

glm::dvec3 position_between(const std::array<Pose, 4>& poses, const CubicTerms& terms) {
  const glm::dvec3& from = poses[1].position_m;
  const glm::dvec3 before = (from - poses[0].position_m) * terms.before_scale;
  const glm::dvec3 step = poses[2].position_m - from;
  const glm::dvec3 after = (poses[3].position_m - poses[2].position_m) * terms.after_scale;
  if (is_jump(glm::length(before), glm::length(step), glm::length(after))) return from + step * terms.blend;
  return on_cubic(from, before, step, after, terms);
}

/// The components' cubic, brought back to unit length. A steady turn is on it but for the fifth order: the
/// fourth derivative of its components points along them.
glm::dquat rotation_between(const std::array<Pose, 4>& poses, const CubicTerms& terms) {
  std::array<glm::dquat, 4> turn;
  const double scale[3] = {terms.before_scale, 1.0, terms.after_scale};
  double angle_rad[3];
  for (size_t i = 0; i < turn.size(); ++i) {
    turn[i] = poses[i].rotation;
    if (i == 0) continue;
    if (glm::dot(turn[i], turn[i - 1]) < 0.0) turn[i] = -turn[i];
    angle_rad[i - 1] = scale[i - 1] * angle_between_rad(turn[i - 1], turn[i]);
  }
  const bool is_far = *std::max_element(std::begin(angle_rad), std::end(angle_rad)) > kMostCubicTurnRad;
  if (is_far || is_jump(angle_rad[0], angle_rad[1], angle_rad[2]))
    return glm::normalize(glm::slerp(poses[1].rotation, poses[2].rotation, terms.blend));
  return glm::normalize(on_cubic(turn[1], (turn[1] - turn[0]) * terms.before_scale, turn[2] - turn[1],
                                 (turn[3] - turn[2]) * terms.after_scale, terms));
}

}  // namespace

const char* to_string(Interpolation interpolation) {
  switch (interpolation) {
    case Interpolation::None:
      return "none";
    case Interpolation::Linear:
      return "linear";
    case Interpolation::Cubic:
      return "cubic";
  }
  return "?";
}

Interpolation choose_interpolation(const std::deque<std::shared_ptr<const Snapshot>>& states, size_t later) {
  if (later == 0 || later >= states.size()) return Interpolation::None;
  if (later < 2 || later + 1 >= states.size()) return Interpolation::Linear;
  const auto step_ns = [&](size_t to) { return states[to]->sim_time_ns - states[to - 1]->sim_time_ns; };
  const int64_t inner_ns = step_ns(later);
  if (inner_ns <= 0 || inner_ns > kLongestCubicStepNs) return Interpolation::Linear;
  for (const int64_t outer_ns : {step_ns(later - 1), step_ns(later + 1)}) {
    if (outer_ns <= 0 || outer_ns > kLongestCubicStepNs) return Interpolation::Linear;
    if (outer_ns > kMostUnevenSteps * inner_ns || inner_ns > kMostUnevenSteps * outer_ns)
      return Interpolation::Linear;
  }
  return Interpolation::Cubic;
}

CubicTerms cubic_terms(const KnotTimes& sim_time_ns, int64_t time_ns) {
  const auto before = static_cast<double>(sim_time_ns[1] - sim_time_ns[0]);
  const auto inner = static_cast<double>(sim_time_ns[2] - sim_time_ns[1]);
  const auto after = static_cast<double>(sim_time_ns[3] - sim_time_ns[2]);
  CHECK(before > 0.0 && inner > 0.0 && after > 0.0);
  CubicTerms terms;
  terms.blend = static_cast<double>(time_ns - sim_time_ns[1]) / inner;
  terms.before_scale = inner / before;
  terms.after_scale = inner / after;
  // Of the parabola through the last three; the other one has the rest.
  const double share = static_cast<double>(time_ns - sim_time_ns[0]) / (before + inner + after);
  const double bend = -terms.blend * (1.0 - terms.blend);
  terms.bend_before = bend * (1.0 - share) * inner / (before + inner);
  terms.bend_after = bend * share * inner / (inner + after);
  return terms;
}

Pose interpolate(const std::array<Pose, 4>& poses, const CubicTerms& terms) {
  return {position_between(poses, terms), rotation_between(poses, terms)};
}

PosedStrands blend(const PosedStrands& from, const PosedStrands& to, double blend, simd::InstructionSet set) {
  if (blend <= 0.0) return from;
  // Without a rest shape a change to fewer strands leaves nothing to blend.
  if (blend >= 1.0 || from.position_m.size() != to.position_m.size()) return to;
  PosedStrands between{interpolate(from.world_from_head, to.world_from_head, blend), {}, {}};
  between.bust = from.bust + blend * (to.bust - from.bust);
  between.position_m.resize(from.position_m.size());
  if (between.position_m.empty()) return between;
  blend_on_line(set, {coordinates(from), coordinates(to), &between.position_m.data()->x,
                      3 * between.position_m.size(), static_cast<float>(blend)});
  return between;
}

PosedStrands blend(const std::array<const PosedStrands*, 4>& states, const CubicTerms& terms,
                   simd::InstructionSet set) {
  const size_t vertex_count = states[1]->position_m.size();
  for (const PosedStrands* state : states) CHECK(state->position_m.size() == vertex_count);
  if (terms.blend <= 0.0) return *states[1];
  if (terms.blend >= 1.0) return *states[2];
  PosedStrands between;
  between.world_from_head = interpolate({states[0]->world_from_head, states[1]->world_from_head,
                                         states[2]->world_from_head, states[3]->world_from_head},
                                        terms);
  between.bust = states[1]->bust + terms.blend * (states[2]->bust - states[1]->bust);
  between.position_m.resize(vertex_count);
  if (vertex_count == 0) return between;
  CubicBlend work;
  for (size_t i = 0; i < states.size(); ++i) work.state[i] = coordinates(*states[i]);
  work.out = &between.position_m.data()->x;
  work.count = 3 * vertex_count;
  work.blend = static_cast<float>(terms.blend);
  work.before_scale = static_cast<float>(terms.before_scale);
  work.after_scale = static_cast<float>(terms.after_scale);
  work.bend_before = static_cast<float>(terms.bend_before);
  work.bend_after = static_cast<float>(terms.bend_after);
  blend_on_cubic(set, work);
  return between;
}

}  // namespace strandcast
