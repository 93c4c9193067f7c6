// MotionRow: where the vertices of one row (one vertex index, all strands) are expected, four strands at a
// time; what encoder and decoder of the "tangent" codec share. Private to common/codec.
//
// What a vertex costs: 240 floating-point operations (2 x 3 x 25 of them for the prediction), two divisions
// and two roots; 135 bytes from and to memory (30 planes, the integers); three symbols, each of which waits
// for the one before it, about 25 cycles (find 10, table 5, multiply and add 5, refill 5). At 2.45 GHz and
// four lanes that is 60 cycles of arithmetic, 33 of memory at 10 GB/s and 75 of waiting.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "common/codec/lanes.h"
#include "common/codec/tangent_motion.h"

namespace strandcast {

static_assert(kBlockSize % kLaneCount == 0);

// Features of a vertex, each a vector; weights are the same for all axes. "then" is the last frame, "before"
// the one before that; the parent is the vertex nearer to the root.
//   0 velocity then            1 residual then        2 velocity before      3 residual before
//   4 drift                    5 parent's now         6 parent's then        7 parent's residual before
//   8 grandparent's now        9 grandparent's then  10 great-grandparent's now
//  11 child's velocity        12 child's residual    13 child's before      14 child's residual before
//  15 grandchild's velocity
//  16 neighbour's now         17 neighbour's then    18 neighbour's residual
//  19 neighbour's parent's now                       20 second neighbour's now  21 its parent's now
//  22 to 27 the last steps of the head at the last position, newest first
inline constexpr uint32_t kRowFeatureCount = 16;
inline constexpr uint32_t kNeighbourFeature = kRowFeatureCount;
inline constexpr uint32_t kSecondNeighbourFeature = kNeighbourFeature + 4;
inline constexpr uint32_t kHeadFeature = kSecondNeighbourFeature + 2;
inline constexpr uint32_t kOwnThen = 0;
inline constexpr uint32_t kOwnResidual = 1;
inline constexpr uint32_t kOwnDrift = 4;
inline constexpr uint32_t kParentNow = 5;
inline constexpr uint32_t kGrandparentNow = 8;
inline constexpr uint32_t kGreatGrandparentNow = 10;
inline constexpr uint32_t kChildResidual = 12;
static_assert(kHeadFeature + kHeadStepCount == kMotionFeatureCount);

// The cell of a coded vertex: tangent steps of 1.32 bounds and length steps of 0.65 keep its farthest point
// within the bound, with room for rounding: sqrt(1 - 1.32^2 / 2) = 0.36 >= 0.65 / 2.
inline constexpr float kTangentStep = 1.32f * kStepsPerBound;
inline constexpr float kLengthStep = 0.65f * kStepsPerBound;
inline constexpr int32_t kEscapeStep = 292;  // 2 (kStepsPerBound - 3) / sqrt(3)

inline constexpr float kTinySquared = 1e-12f;
inline constexpr float kLargestEdge = 4e6f;     // in steps; rounding by adding needs it
inline constexpr float kRounder = 12582912.0f;  // 1.5 * 2^23: floats there are whole numbers

/// Nearest whole numbers, ties to even, limited to +-kLargestEdge; -kLargestEdge for NaN.
STRANDCAST_INLINE IntLanes nearest_lanes(const Lanes& value) {
  const Lanes low = value > -kLargestEdge ? value : Lanes{} - kLargestEdge;
  const Lanes within = low < kLargestEdge ? low : Lanes{} + kLargestEdge;
  return to_integers((within + kRounder) - kRounder);
}

/// Which weights serve a row. Near the root and at the tip strands move by laws of their own.
uint32_t motion_class(const TangentLayout& layout, uint32_t v);

/// Rows of floats that features of one axis lie in; absent ones are zeros.
using FeatureRows = std::array<const float*, kRowFeatureCount>;
FeatureRows feature_rows(const TangentLayout& layout, const TangentHistory& history,
                         const TangentFrame& frame, size_t axis, uint32_t v);

using FloatWeights = std::array<float, kMotionFeatureCount>;
struct LastAndBase {
  const int32_t* last;
  const int32_t* base;
};
/// sum = (last - base) + weighted features, for as many places; whole blocks. A pass of its own: nothing in
/// it waits for other places, while the rest of a prediction is one long chain for each block.
void sum_rows(const FeatureRows& rows, const FloatWeights& weights, const LastAndBase& positions,
              std::span<float> sum);

/// The integers of a block.
struct CodeLanes {
  IntLanes first{};
  IntLanes second{};
  IntLanes length{};
};

STRANDCAST_INLINE CodeLanes sum_of(const CodeLanes& a, const CodeLanes& b) {
  return {wrapping_sums(a.first, b.first), wrapping_sums(a.second, b.second),
          wrapping_sums(a.length, b.length)};
}

/// Escaped vertices.
using Lattice = std::array<int32_t, 3>;
Escape make_escape(size_t at, const Lattice& target, const Lattice& from);
Lattice escaped(const Escape& escape, const Lattice& from);
inline Lattice lane_of(const IntLaneVectors& vectors, size_t lane) {
  return {vectors.axis[0][lane], vectors.axis[1][lane], vectors.axis[2][lane]};
}

/// Where the vertices of a block are expected: `length` along `along` from `base`, and two directions across.
struct Expected {
  IntLaneVectors base;
  LaneVectors along;
  LaneVectors first;
  LaneVectors second;
  Lanes length;

  /// Along `edge` and as long.
  STRANDCAST_INLINE void aim(const LaneVectors& edge) {
    const Lanes squared = dots(edge, edge);
    length = square_roots(squared);
    const Lanes scale = squared > kTinySquared ? 1.0f / length : Lanes{};
    for (size_t axis = 0; axis < 3; ++axis) {
      const Lanes instead = Lanes{} + (axis == 1 ? 1.0f : 0.0f);  // where there is no direction
      along.axis[axis] = scale != 0.0f ? edge.axis[axis] * scale : instead;
    }
    find_frames();
  }

  /// Fills the directions across `along`: an orthonormal basis without branches (Duff et al. 2017, Building
  /// an Orthonormal Basis, Revisited).
  STRANDCAST_INLINE void find_frames() {
    const auto& [x, y, z] = along.axis;
    const Lanes one = Lanes{} + 1.0f;
    const Lanes sign = z >= 0.0f ? one : -one;
    const Lanes a = -1.0f / (sign + z);
    const Lanes b = x * y * a;
    first.axis[0] = 1.0f + sign * (x * x * a);
    first.axis[1] = sign * b;
    first.axis[2] = -sign * x;
    second.axis[0] = b;
    second.axis[1] = sign + y * y * a;
    second.axis[2] = -y;
  }

  /// What would be the integers of an edge, were they not whole; false where they cannot tell it.
  struct Coordinates {
    Lanes first;
    Lanes second;
    Lanes length;
    IntLanes is_possible;
  };
  STRANDCAST_INLINE Coordinates coordinates(const LaneVectors& edge) const {
    constexpr float kSteepest = 0.2f;
    constexpr float kFarthest = 1e5f;
    const Lanes beside = dots(edge, along);
    const Lanes size = square_roots(dots(edge, edge));
    // Seen from the vertex before, where the direction of the edge meets the tangent plane.
    const Lanes scale = size > 0.0f ? length / beside / kTangentStep : Lanes{};
    Coordinates of;
    of.first = dots(edge, first) * scale;
    of.second = dots(edge, second) * scale;
    of.length = (size - length) / kLengthStep;
    const IntLanes is_steep = (size > 0.0f) & ~(beside > kSteepest * size);
    of.is_possible = ~is_steep & (sizes_of(of.first) < kFarthest) & (sizes_of(of.second) < kFarthest) &
                     (sizes_of(of.length) < kFarthest);
    return of;
  }
  /// The integers that come nearest to what `other` expects from the same base.
  STRANDCAST_INLINE CodeLanes codes_of(const Expected& other) const {
    LaneVectors edge;
    for (size_t axis = 0; axis < 3; ++axis) edge.axis[axis] = other.along.axis[axis] * other.length;
    const Coordinates of = coordinates(edge);
    CodeLanes codes;
    codes.first = of.is_possible ? nearest_lanes(of.first) : IntLanes{};
    codes.second = of.is_possible ? nearest_lanes(of.second) : IntLanes{};
    codes.length = of.is_possible ? nearest_lanes(of.length) : IntLanes{};
    return codes;
  }

  /// Positions, limited to where rounding holds, that the integers tell.
  STRANDCAST_INLINE IntLaneVectors placed(const CodeLanes& codes) const {
    const Lanes across = to_floats(codes.first) * kTangentStep;
    const Lanes also = to_floats(codes.second) * kTangentStep;
    LaneVectors edge;
    for (size_t axis = 0; axis < 3; ++axis)
      edge.axis[axis] = (along.axis[axis] * length + first.axis[axis] * across) + second.axis[axis] * also;
    const Lanes squared = dots(edge, edge);
    const Lanes wanted = length + to_floats(codes.length) * kLengthStep;
    const Lanes scale = squared > kTinySquared ? wanted / square_roots(squared) : Lanes{};
    IntLaneVectors position;
    for (size_t axis = 0; axis < 3; ++axis)
      position.axis[axis] = wrapping_sums(base.axis[axis], nearest_lanes(edge.axis[axis] * scale));
    return position;
  }
};

class MotionRow {
 public:
  MotionRow(const TangentLayout& layout, const TangentHistory& history, TangentFrame& frame, uint32_t v)
      : layout_(layout), history_(history), frame_(frame), v_(v) {
    const auto& given = frame.weights[motion_class(layout, v)];
    for (uint32_t k = 0; k < kMotionFeatureCount; ++k)
      weights_[k] = static_cast<float>(given[k]) * kMotionWeight;
    for (size_t axis = 0; axis < 3; ++axis) {
      for (size_t i = 0; i < head_[axis].size(); ++i) {
        head_[axis][i] = 0.0f;
        for (size_t k = 0; k < kHeadStepCount; ++k)
          head_[axis][i] += static_cast<float>(frame.head.step[k].row[axis][i]) * weights_[kHeadFeature + k];
      }
    }
    length_blend_ = static_cast<float>(frame.length_blend) * kLengthWeight;
    for (size_t axis = 0; axis < 3; ++axis) features_[axis] = feature_rows(layout, history, frame, axis, v);
  }

  /// Of a place in this row, in a plane.
  size_t at(size_t place) const { return v_ * static_cast<size_t>(layout_.stride) + place; }

  /// The part of the prediction that comes from whole rows, for a slice; before its blocks are expected.
  void sum_features(uint32_t slice) const {
    const size_t begin = layout_.slice_begin[slice];
    const size_t count = layout_.slice_begin[slice + 1] - begin;
    for (size_t axis = 0; axis < 3; ++axis) {
      FeatureRows rows = features_[axis];
      for (const float*& row : rows) row += begin;
      const int32_t* last = history_.lattice[axis].data() + at(begin);
      const int32_t* base = v_ == 0 ? frame_.zero_lattice.data() : bases(axis) + begin;
      sum_rows(rows, weights_, {last, base}, std::span(frame_.edge[axis]).subspan(begin, count));
    }
  }

  /// Blocks of a slice come in order.
  STRANDCAST_INLINE void expect(size_t place, Expected& expected) const {
    LaneVectors last;
    for (size_t axis = 0; axis < 3; ++axis)
      last.axis[axis] = to_floats(load_lanes(history_.lattice[axis].data() + at(place)));
    const Lanes presence = load_lanes(layout_.presence.data() + place);
    LaneVectors edge;
    for (size_t axis = 0; axis < 3; ++axis) {
      expected.base.axis[axis] = v_ == 0 ? IntLanes{} : load_lanes(bases(axis) + place);
      const auto& head = head_[axis];
      const Lanes turned = (head[0] * last.axis[0] + head[1] * last.axis[1]) + head[2] * last.axis[2];
      edge.axis[axis] = load_lanes(frame_.edge[axis].data() + place) + (turned + head[3] * presence);
      for (uint32_t which = 0; which < 2; ++which)
        edge.axis[axis] +=
            gather_lanes(frame_.neighbour_sum[which][axis].data(), layout_.neighbour[which].data() + place);
    }
    expected.aim(edge);
    if (v_ != 0) expected.length = known_length(place);
  }

  /// Stores positions and what follows from them.
  STRANDCAST_INLINE void store(const Expected& expected, size_t place, const IntLaneVectors& position) const {
    for (size_t axis = 0; axis < 3; ++axis) {
      const size_t begin = at(place);
      const IntLanes& now = position.axis[axis];
      const IntLanes last = load_lanes(history_.lattice[axis].data() + begin);
      const Lanes velocity = to_floats(wrapping_differences(now, last));
      const Lanes edge = to_floats(wrapping_differences(now, expected.base.axis[axis]));
      store_lanes(now, frame_.lattice[axis].data() + begin);
      store_lanes(velocity, frame_.velocity[axis].data() + begin);
      store_lanes(edge - expected.along.axis[axis] * expected.length, frame_.residual[axis].data() + begin);
      const Lanes drift = load_lanes(features_[axis][kOwnDrift] + place);
      store_lanes(kDriftShare * drift + velocity, frame_.drift[axis].data() + begin);
      // What later blocks add for this neighbour.
      const Lanes then = load_lanes(features_[axis][kOwnThen] + place);
      const Lanes residual = load_lanes(features_[axis][kOwnResidual] + place);
      const Lanes parent = load_lanes(features_[axis][kParentNow] + place);
      const float* weight = weights_.data() + kNeighbourFeature;
      store_lanes(((weight[0] * velocity + weight[1] * then) + weight[2] * residual) + weight[3] * parent,
                  frame_.neighbour_sum[0][axis].data() + place);
      weight = weights_.data() + kSecondNeighbourFeature;
      store_lanes(weight[0] * velocity + weight[1] * parent, frame_.neighbour_sum[1][axis].data() + place);
    }
  }

  /// Of a vertex of the row: its last position, which escapes count from.
  Lattice last(size_t at) const {
    return {history_.lattice[0][at], history_.lattice[1][at], history_.lattice[2][at]};
  }
  TangentFrame& frame() const { return frame_; }

 private:
  STRANDCAST_INLINE Lanes known_length(size_t place) const {
    const Lanes rest = load_lanes(layout_.rest_length_m.data() + at(place)) / history_.quantum_m;
    if (frame_.length_blend == 0) return rest;
    LaneVectors edge;
    for (size_t axis = 0; axis < 3; ++axis) {
      const int32_t* own = history_.lattice[axis].data() + at(place);
      edge.axis[axis] = to_floats(wrapping_differences(load_lanes(own), load_lanes(own - layout_.stride)));
    }
    return rest + length_blend_ * (square_roots(dots(edge, edge)) - rest);
  }

  /// Decoded positions of the parents; not for roots.
  const int32_t* bases(size_t axis) const { return frame_.lattice[axis].data() + at(0) - layout_.stride; }

  const TangentLayout& layout_;
  const TangentHistory& history_;
  TangentFrame& frame_;
  uint32_t v_;
  FloatWeights weights_;
  std::array<std::array<float, 4>, 3> head_;  // the head's steps, weighted
  float length_blend_;
  std::array<FeatureRows, 3> features_;
};

}  // namespace strandcast
