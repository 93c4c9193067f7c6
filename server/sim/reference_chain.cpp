#include "server/sim/reference_chain.h"

#include <algorithm>
#include <cmath>

#include "server/sim/solvers/direct_rod/direct_rod_rest.h"

namespace strandcast {
namespace {

constexpr double kTinyLength = 1e-10;
constexpr double kMinLengthM = 1e-5;
// As in the kernel, which says why.
constexpr uint32_t kHeldRounds = 2;
constexpr double kAnchorMass = 100.0;
constexpr double kMaxTurnRad = 1.0;

const glm::dvec3 kAxis(1.0, 0.0, 0.0);   // of a frame: across the segment
const glm::dvec3 kAlong(0.0, 0.0, 1.0);  // of a frame: along the segment

glm::dquat spun(const glm::dquat& frame, double angle) {
  return frame * glm::angleAxis(angle, kAlong);
}

/// Rotation vector between two frames, with the sine for the angle.
glm::dvec3 turn_between(const glm::dquat& from, const glm::dquat& to) {
  const glm::dquat turn = to * glm::conjugate(from);
  return 2.0 * turn.w * glm::dvec3(turn.x, turn.y, turn.z);
}

/// A frame that goes with the direction; which one does not matter.
glm::dquat frame_along(const glm::dvec3& along) {
  const glm::dvec3 other = std::abs(along.x) < 0.6 ? kAxis : glm::dvec3(0.0, 1.0, 0.0);
  const glm::dvec3 axis = glm::normalize(glm::cross(along, other));
  return glm::normalize(glm::quat_cast(glm::dmat3(axis, glm::cross(along, axis), along)));
}

}  // namespace

glm::dquat carried_frame(const glm::dquat& frame, const glm::dvec3& along) {
  return smallest_rotation(frame * kAlong, along) * frame;
}

glm::dvec3 bend_between(const glm::dvec3& from, const glm::dvec3& to) {
  const double half_sine = std::min(0.5 * glm::distance(from, to), std::sqrt(kMaxHalfSineSquared));
  const double angle = 2.0 * std::asin(half_sine);
  return (angle > 1e-9 ? angle / std::sin(angle) : 1.0) * glm::cross(from, to);
}

double ReferenceChain::bend_stiffness(const ReferenceChainState& chain, size_t i,
                                      double tension_m2ps2) const {
  const double b = parameters_.bend_stiffness_m4ps2;
  if (i == 0) return clamp_stiffness(b, tension_m2ps2, chain.segment[0].lever_m);
  return 2.0 * b / (chain.segment[i].lever_m + chain.segment[i - 1].lever_m);
}

void ReferenceChain::turn(ChainSegment& segment, const glm::dvec3& rotation) {
  const glm::dvec3 within =
      rotation * std::min(1.0, kMaxTurnRad / std::max(glm::length(rotation), kTinyLength));
  segment.frame = glm::normalize(glm::dquat(1.0, 0.5 * within) * segment.frame);
  segment.turn += within;
}

void ReferenceChain::solve(ReferenceStrand& strand) const {
  if (layout().tail_begin() <= layout().pinned_root_count) return;
  ReferenceChainState chain = begin(strand);
  bool is_sound = true;
  const bool is_held = layout().pinned_tail_count > 0;
  const uint32_t rounds = is_held ? std::max(parameters_.effort, kHeldRounds) : parameters_.effort;
  for (uint32_t k = 0; k < rounds && is_sound; ++k) is_sound = turn_segments(chain);
  finish(chain, is_sound, strand);
}

void ReferenceChain::finish(const ReferenceChainState& chain, bool is_sound, ReferenceStrand& strand) const {
  const uint32_t first = layout().pinned_root_count;
  glm::dquat untwisted = chain.clamp;
  glm::dvec3 missed(0.0);
  double way_m = 0.0;
  if (layout().pinned_tail_count > 0) {
    missed = strand.target_m[layout().tail_begin()] - chain.root_m;
    for (const ChainSegment& segment : chain.segment) {
      missed -= segment.length_m * segment.along();
      way_m += segment.length_m;
    }
    missed /= std::max(way_m, kMinLengthM);
    way_m = 0.0;
  }
  glm::dvec3 solved = chain.root_m;
  for (uint32_t i = first; i < layout().tail_begin(); ++i) {
    const ChainSegment& segment = chain.segment[i - first];
    const glm::dvec3 groomed =
        direction_or(strand.target_m[i] - strand.target_m[i - 1], chain.clamp * kAlong);
    const glm::dvec3 along = is_sound ? segment.along() : groomed;
    untwisted = carried_frame(untwisted, along);
    const glm::dquat spin = glm::conjugate(untwisted) * segment.frame;
    strand.memory[i] = is_sound ? 2.0 * std::atan(spin.z / spin.w) : 0.0;
    solved += segment.length_m * along;
    way_m += segment.length_m;
    strand.predicted_m[i] = solved + way_m * missed;
    place(strand, i);
  }
}

glm::dvec3 ReferenceChain::rest_m(const ReferenceStrand& strand, uint32_t i) const {
  return glm::dvec3(layout().rest[layout().index(i, strand.index)]);
}

ReferenceChainState ReferenceChain::begin(const ReferenceStrand& strand) const {
  const uint32_t first = layout().pinned_root_count;
  const uint32_t last = std::min(layout().tail_begin(), layout().vertex_count - 1);
  const uint32_t clamp_end = std::max(first - 1, 1u);
  const glm::dquat head = rotation();
  const glm::dquat old_head = glm::conjugate(carry()) * head;
  glm::dquat rest = frame_along(
      direction_or(rest_m(strand, clamp_end) - rest_m(strand, clamp_end - 1), glm::dvec3(0.0, 1.0, 0.0)));
  ReferenceChainState chain;
  chain.root_m = strand.target_m[first - 1];
  chain.clamp = head * rest;
  chain.clamp_turn = turn_between(old_head * rest, chain.clamp);
  glm::dquat old = old_head * rest;
  glm::dquat now = chain.clamp;
  double total = 0.0;
  for (uint32_t i = first; i <= last; ++i) {
    ChainSegment segment;
    segment.length_m = strand.segment_m[i];
    segment.lever_m = std::max(segment.length_m, kMinLengthM);
    const glm::dvec3 rest_edge = rest_m(strand, i) - rest_m(strand, i - 1);
    const glm::dquat rest_next = carried_frame(rest, direction_or(rest_edge, rest * kAlong));
    segment.rest_turn = glm::conjugate(rest) * rest_next;
    rest = rest_next;
    const glm::dvec3 old_edge = strand.old_m[i] - strand.old_m[i - 1];
    glm::dvec3 moved = h_s() * (strand.velocity_mps[i] - strand.velocity_mps[i - 1]);
    if (glm::length(moved) > segment.length_m) moved *= segment.length_m / glm::length(moved);
    old = carried_frame(old, direction_or(old_edge, old_head * (rest * kAlong)));
    now = carried_frame(now, direction_or(old_edge + moved, head * (rest * kAlong)));
    segment.frame = spun(now, strand.memory[i]);
    segment.turn = turn_between(spun(old, strand.memory[i]), segment.frame);
    const double half_mass = 0.5 * segment.lever_m;
    if (i > first) chain.segment.back().mass_m += half_mass * strand.inertia[i - 1];
    segment.mass_m = half_mass * strand.inertia[i];
    segment.aim_m = strand.predicted_m[i];
    total += half_mass;
    chain.segment.push_back(segment);
  }
  if (layout().pinned_tail_count > 0) {
    chain.segment.back().aim_m = strand.target_m[last];
    chain.segment.back().mass_m = 2.0 * kAnchorMass * total;
  }
  return chain;
}

}  // namespace strandcast
