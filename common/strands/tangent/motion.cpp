#include "common/strands/tangent/motion.h"

#include <algorithm>
#include <utility>

#include "common/strands/tangent/row.h"
#include "common/strands/wrapping.h"

namespace strandcast::tangent {
uint32_t motion_class_count(const Layout& layout) {
  const size_t vertices = size_t{layout.strand_count} * layout.vertex_count;
  if (vertices < kManyVertices) return kFewMotionClasses;
  return std::min(kMotionClassCount, layout.vertex_count);
}

uint32_t motion_class(const Layout& layout, uint32_t v) {
  const uint32_t last = std::max(layout.vertex_count, 2u) - 1;
  if (size_t{layout.strand_count} * layout.vertex_count >= kManyVertices)
    return v * (motion_class_count(layout) - 1) / last;
  if (v < 2) return 0;
  return v == last ? 1 : 2;
}

FeatureRows feature_rows(const Layout& layout, const History& history, const Frame& frame, size_t axis,
                         uint32_t v) {
  const std::array planes = {&frame.velocity,   &history.velocity,        &history.velocity_before,
                             &history.residual, &history.residual_before, &history.drift};
  FeatureRows rows;
  for (size_t k = 0; k < rows.size(); ++k) {
    const MotionFeature& feature = kMotionFeatures[k];
    const int64_t vertex = int64_t{v} + feature.tipward;
    const bool is_there = vertex >= 0 && vertex < int64_t{layout.vertex_count};
    const float* plane = (*planes[static_cast<size_t>(feature.quantity)])[axis].data();
    rows[k] = is_there ? plane + static_cast<size_t>(vertex) * layout.stride : frame.zeros.data();
  }
  return rows;
}

Escape make_escape(size_t at, const Lattice& target, const Lattice& from, int32_t step) {
  Escape escape;
  escape.at = at;
  for (size_t axis = 0; axis < 3; ++axis) {
    const int64_t way = int64_t{target[axis]} - from[axis];
    const int64_t half = way < 0 ? -step / 2 : step / 2;
    escape.step[axis] = static_cast<int32_t>((way + half) / step);
  }
  return escape;
}

Lattice escaped(const Escape& escape, const Lattice& from, int32_t step) {
  Lattice position;
  for (size_t axis = 0; axis < 3; ++axis) {
    const uint32_t moved = static_cast<uint32_t>(escape.step[axis]) * static_cast<uint32_t>(step);
    position[axis] = wrapping_sum(from[axis], static_cast<int32_t>(moved));
  }
  return position;
}

void History::reset(const Layout& layout) {
  has_motion = has_residual = false;
  for (size_t axis = 0; axis < 3; ++axis) {
    lattice[axis].assign(layout.plane_size(), 0);
    for (auto* planes : {&velocity, &velocity_before, &residual, &residual_before, &drift})
      (*planes)[axis].assign(layout.plane_size(), 0.0f);
  }
}

namespace {

void clear(std::initializer_list<Planes<float>*> all) {
  for (auto* planes : all)
    for (auto& plane : *planes) std::fill(plane.begin(), plane.end(), 0.0f);
}

}  // namespace

void History::forget_motion() {
  forget_residual();
  forget_all_but_residual();
  head = {head.pose, {}};
}

void History::forget_residual() {
  if (std::exchange(has_residual, false)) clear({&residual});
}

void History::forget_all_but_residual() {
  if (!has_motion) return;
  clear({&velocity, &velocity_before, &residual_before, &drift});
  has_motion = false;
}

void Codes::resize(const Layout& layout) {
  // Zeros, as places without a strand must hold them also after a chain with another layout.
  for (auto* values : {&first, &second, &length}) values->assign(layout.plane_size(), 0);
  escapes.assign(layout.slice_count(), {});
}

void Frame::resize(const Layout& layout) {
  const size_t size = layout.plane_size();
  codes.resize(layout);
  shape_codes.resize(layout);
  for (size_t axis = 0; axis < 3; ++axis) {
    lattice[axis].assign(size, 0);
    velocity[axis].assign(size, 0.0f);
    residual[axis].assign(size, 0.0f);
    drift[axis].assign(size, 0.0f);
  }
  zeros.assign(layout.stride, 0.0f);
  zero_lattice.assign(layout.stride, 0);
  for (auto& row : edge) row.assign(layout.stride, 0.0f);
  for (auto& planes : neighbour_sum)
    for (auto& row : planes) row.assign(layout.stride, 0.0f);
}

void Frame::apply_weights() {
  for (size_t c = 0; c < motion.size(); ++c) {
    MotionClass& by = motion[c];
    for (uint32_t k = 0; k < kMotionFeatureCount; ++k)
      by.weights[k] = static_cast<float>(weights[c][k]) * kMotionWeight;
    for (size_t axis = 0; axis < 3; ++axis) {
      for (size_t i = 0; i < by.head[axis].size(); ++i) {
        float& sum = by.head[axis][i] = 0.0f;
        for (size_t k = 0; k < kHeadStepCount; ++k)
          sum += static_cast<float>(head.step[k].row[axis][i]) * by.weights[kHeadFeature + k];
      }
    }
  }
}

void remember(History& history, Frame& frame) {
  history.head = frame.head;
  std::swap(history.lattice, frame.lattice);
  std::swap(history.velocity_before, history.velocity);
  std::swap(history.velocity, frame.velocity);
  std::swap(history.residual_before, history.residual);
  std::swap(history.residual, frame.residual);
  std::swap(history.drift, frame.drift);
  history.has_motion = history.has_residual = true;
}

void remember_step(History& history, Frame& frame) {
  history.head = frame.head;
  std::swap(history.lattice, frame.lattice);
  std::swap(history.residual, frame.residual);
  history.has_residual = true;
  history.forget_all_but_residual();
}

void remember_exact(History& history, const Pose& world_from_head) {
  history.head = {world_from_head, {}};
  history.forget_residual();
  history.forget_all_but_residual();
}

}  // namespace strandcast::tangent
