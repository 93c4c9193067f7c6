// ShapeRow: predicts the vertices of one row from the shape of the strands alone, eight strands at a time. It
// uses edges nearer to the root, neighbours and the rest shape, but no earlier frame. Keyframes of the
// "tangent" codec are predicted this way. Private to common/strands/tangent.
#pragma once

#include "common/strands/tangent/row.h"

namespace strandcast::tangent {

// Features of a vertex, each a vector: an edge (for a root its position, which tells nothing to others) or
// what follows from edges. A bend is an edge less what it would be had it turned from its rest edge like its
// parent; an edge x *turned* by another one is x after the smallest rotation that takes that one's rest edge
// to its direction.
//   0 rest             1 parent            2 grandparent      3 parent's rest
//   4 neighbour        5 its parent        6 its rest         7 to 9 second neighbour likewise
//  10 rest turned by the parent           11 by the neighbour                 12 by the second neighbour
//  13 parent's bend                       14 neighbour's bend                 15 second neighbour's bend
using ShapeFeatures = std::array<LaneVectors, kShapeFeatureCount>;

/// Returns the weight class of a row.
inline uint32_t shape_class(uint32_t v) {
  return std::min(v, kShapeClassCount - 1);
}

using Places = std::array<uint32_t, kLaneCount>;

STRANDCAST_LANES LaneVectors difference(const LaneVectors& a, const LaneVectors& b) {
  return {a.axis[0] - b.axis[0], a.axis[1] - b.axis[1], a.axis[2] - b.axis[2]};
}

/// Rotates `x` by the smallest rotation from the direction of `from` to that of `to`; returns zero where
/// there is none.
STRANDCAST_LANES LaneVectors turned(const LaneVectors& x, const LaneVectors& from, const LaneVectors& to) {
  constexpr float kTiny = 1.0f;
  constexpr float kLargest = 1e15f;
  constexpr float kLeastSum = 0.05f;  // of one and the cosine
  const Lanes from_squared = dots(from, from);
  const Lanes to_squared = dots(to, to);
  const Lanes from_scale = 1.0f / square_roots(from_squared);
  const Lanes to_scale = 1.0f / square_roots(to_squared);
  LaneVectors a;
  LaneVectors b;
  LaneVectors sum;
  for (size_t i = 0; i < 3; ++i) {
    a.axis[i] = from.axis[i] * from_scale;
    b.axis[i] = to.axis[i] * to_scale;
    sum.axis[i] = a.axis[i] + b.axis[i];
  }
  const Lanes one_and_cosine = 1.0f + dots(a, b);
  const IntLanes is_turned = (from_squared > kTiny) & (from_squared < kLargest) & (to_squared > kTiny) &
                             (to_squared < kLargest) & (one_and_cosine > kLeastSum);
  const Lanes along_sum = dots(x, sum) / one_and_cosine;
  const Lanes along_from = 2.0f * dots(x, a);
  LaneVectors result;
  for (size_t i = 0; i < 3; ++i) {
    const Lanes value = (x.axis[i] - along_sum * sum.axis[i]) + along_from * b.axis[i];
    result.axis[i] = is_turned ? value : Lanes{};
  }
  return result;
}

/// Reads edges at given places.
struct Edges {
  const Layout& layout;
  float quantum_m;
  const Planes<int32_t>& position;

  STRANDCAST_LANES LaneVectors now(const uint32_t* place, uint32_t v) const {
    const size_t row = v * static_cast<size_t>(layout.stride);
    LaneVectors edge;
    for (size_t axis = 0; axis < 3; ++axis) {
      const int32_t* plane = position[axis].data() + row;
      const IntLanes end = gather_lanes(plane, place);
      edge.axis[axis] =
          to_floats(v == 0 ? end : wrapping_differences(end, gather_lanes(plane - layout.stride, place)));
    }
    return edge;
  }
  STRANDCAST_LANES LaneVectors rest(const uint32_t* place, uint32_t v) const {
    LaneVectors edge;
    for (size_t axis = 0; axis < 3; ++axis) {
      const float* plane = layout.rest_edge_m[axis].data() + v * static_cast<size_t>(layout.stride);
      edge.axis[axis] = gather_lanes(plane, place) / quantum_m;
    }
    return edge;
  }
};

class ShapeRow {
 public:
  /// Makes the row of vertex v. Reads `position` of earlier rows, and of earlier blocks of this row.
  ShapeRow(const Layout& layout, const Neighbours& beside, float quantum_m, const Planes<int32_t>& position,
           uint32_t v)
      : layout_(layout), beside_(beside), quantum_m_(quantum_m), position_(position), v_(v) {}

  ShapeFeatures features(size_t place) const;
  Expected expect(size_t place, const ShapeWeights& weights) const;
  size_t at(size_t place) const { return v_ * static_cast<size_t>(layout_.stride) + place; }
  /// Returns the positions of the preceding vertices, or the origin for roots.
  IntLaneVectors base(size_t place) const;

 private:
  const Layout& layout_;
  const Neighbours& beside_;
  float quantum_m_;
  const Planes<int32_t>& position_;
  uint32_t v_;
};

STRANDCAST_LANES IntLaneVectors ShapeRow::base(size_t place) const {
  IntLaneVectors base{};
  if (v_ == 0) return base;
  for (size_t axis = 0; axis < 3; ++axis)
    base.axis[axis] = load_lanes(position_[axis].data() + at(place) - layout_.stride);
  return base;
}

STRANDCAST_LANES ShapeFeatures ShapeRow::features(size_t place) const {
  const Edges edges{layout_, quantum_m_, position_};
  Places own;
  for (uint32_t lane = 0; lane < kLaneCount; ++lane) own[lane] = static_cast<uint32_t>(place) + lane;
  ShapeFeatures value{};
  value[0] = edges.rest(own.data(), v_);
  // Edges only: a root's position would be a thousand times their size, and its weight too coarse.
  if (v_ >= 2) {
    value[1] = edges.now(own.data(), v_ - 1);
    value[3] = edges.rest(own.data(), v_ - 1);
    value[10] = turned(value[0], value[3], value[1]);
  }
  if (v_ >= 3) {
    value[2] = edges.now(own.data(), v_ - 2);
    value[13] = difference(value[1], turned(value[3], edges.rest(own.data(), v_ - 2), value[2]));
  }
  for (uint32_t which = 0; which < 2; ++which) {
    const uint32_t* other = beside_[which].data() + place;
    const LaneVectors now = edges.now(other, v_);
    const LaneVectors rest = edges.rest(other, v_);
    value[4 + 3 * which] = now;
    value[6 + 3 * which] = rest;
    if (v_ >= 1) value[11 + which] = turned(value[0], rest, now);
    if (v_ < 2) continue;
    const LaneVectors parent = edges.now(other, v_ - 1);
    value[5 + 3 * which] = parent;
    value[14 + which] = difference(now, turned(rest, edges.rest(other, v_ - 1), parent));
  }
  return value;
}

STRANDCAST_LANES Expected ShapeRow::expect(size_t place, const ShapeWeights& weights) const {
  const ShapeFeatures value = features(place);
  const auto& weight = weights[shape_class(v_)];
  LaneVectors edge{};
  for (uint32_t k = 0; k < kShapeFeatureCount; ++k)
    for (size_t axis = 0; axis < 3; ++axis)
      edge.axis[axis] += static_cast<float>(weight[k]) * kShapeWeight * value[k].axis[axis];
  Expected expected;
  expected.base = base(place);
  expected.aim(edge);
  const Lanes rest = load_lanes(layout_.rest_length_m.data() + at(place)) / quantum_m_;
  expected.length = rest > 0.0f ? rest : expected.length;
  return expected;
}

}  // namespace strandcast::tangent
