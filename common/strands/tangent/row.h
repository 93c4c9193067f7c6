// MotionRow: predicts the vertices of one row (one vertex index, all strands), eight strands at a time.
// Encoder and decoder of the "tangent" codec share it. Private to common/strands/tangent.
//
// Cost of a vertex: 240 floating-point operations (2 x 3 x 25 of them for the prediction), two divisions and
// two roots; 135 bytes from and to memory (30 planes, the integers). motion.h states the cost of a whole
// frame.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

#include "common/simd/raw_lanes.h"
#include "common/strands/tangent/motion.h"

namespace strandcast::tangent {

using namespace simd::raw;

static_assert(kBlockSize == kLaneCount);

/// Quantity of a feature; "then" is the last frame, "before" the one before that.
enum class MotionQuantity : uint8_t {
  Now,  // change of position in this frame
  Then,
  Before,
  ResidualThen,
  ResidualBefore,
  DriftThen
};
enum class MotionStrand : uint8_t { Own, Neighbour, SecondNeighbour };

/// A vector feature with one weight for all axes; it is zero where no such vertex exists.
struct MotionFeature {
  MotionQuantity quantity;
  int8_t tipward = 0;  // vertices from the own one towards the tip: the parent has -1
  MotionStrand strand = MotionStrand::Own;
};

// In the order of their weights; behind them the last steps of the head at the last position, newest first.
inline constexpr std::array kMotionFeatures = {
    MotionFeature{MotionQuantity::Then},
    MotionFeature{MotionQuantity::ResidualThen},
    MotionFeature{MotionQuantity::Before},
    MotionFeature{MotionQuantity::ResidualBefore},
    MotionFeature{MotionQuantity::DriftThen},
    MotionFeature{MotionQuantity::Now, -1},
    MotionFeature{MotionQuantity::Then, -1},
    MotionFeature{MotionQuantity::ResidualBefore, -1},
    MotionFeature{MotionQuantity::Now, -2},
    MotionFeature{MotionQuantity::Then, -2},
    MotionFeature{MotionQuantity::Now, -3},
    MotionFeature{MotionQuantity::Then, 1},
    MotionFeature{MotionQuantity::ResidualThen, 1},
    MotionFeature{MotionQuantity::Before, 1},
    MotionFeature{MotionQuantity::ResidualBefore, 1},
    MotionFeature{MotionQuantity::Then, 2},
    MotionFeature{MotionQuantity::Now, 0, MotionStrand::Neighbour},
    MotionFeature{MotionQuantity::Then, 0, MotionStrand::Neighbour},
    MotionFeature{MotionQuantity::ResidualThen, 0, MotionStrand::Neighbour},
    MotionFeature{MotionQuantity::Now, -1, MotionStrand::Neighbour},
    MotionFeature{MotionQuantity::Now, 0, MotionStrand::SecondNeighbour},
    MotionFeature{MotionQuantity::Now, -1, MotionStrand::SecondNeighbour},
};

constexpr uint32_t first_feature_of(MotionStrand strand) {
  uint32_t k = 0;
  while (k < kMotionFeatures.size() && kMotionFeatures[k].strand < strand) ++k;
  return k;
}
constexpr uint32_t feature_count_of(MotionStrand strand) {
  return static_cast<uint32_t>(
      std::count_if(kMotionFeatures.begin(), kMotionFeatures.end(),
                    [strand](const MotionFeature& feature) { return feature.strand == strand; }));
}
inline constexpr uint32_t kOwnFeatureCount = first_feature_of(MotionStrand::Neighbour);
inline constexpr uint32_t kHeadFeature = kMotionFeatures.size();
static_assert(kHeadFeature + kHeadStepCount == kMotionFeatureCount);
// What is not decoded yet predicts nothing.
static_assert(std::all_of(kMotionFeatures.begin(), kMotionFeatures.end(), [](const MotionFeature& feature) {
  return feature.quantity != MotionQuantity::Now ||
         feature.tipward < (feature.strand == MotionStrand::Own ? 0 : 1);
}));

// The cell of a coded vertex: tangent steps of 1.32 bounds and length steps of 0.65 keep its farthest point
// within the bound, with room for rounding: sqrt(1 - 1.32^2 / 2) = 0.36 >= 0.65 / 2.
inline constexpr float kTangentStep = 1.32f * kStepsPerBound;
inline constexpr float kLengthStep = 0.65f * kStepsPerBound;
inline constexpr int32_t kEscapeStep = 292;  // 2 (kStepsPerBound - 3) / sqrt(3)

inline constexpr float kTinySquared = 1e-12f;
inline constexpr float kLargestEdge = 4e6f;     // in steps; rounding by adding needs it
inline constexpr float kRounder = 12582912.0f;  // 1.5 * 2^23: floats there are whole numbers

/// Rounds to nearest, ties to even, clamped to +-kLargestEdge; NaN gives -kLargestEdge.
STRANDCAST_LANES IntLanes nearest_lanes(const Lanes& value) {
  const Lanes low = value > -kLargestEdge ? value : Lanes{} - kLargestEdge;
  const Lanes within = low < kLargestEdge ? low : Lanes{} + kLargestEdge;
  return to_integers((within + kRounder) - kRounder);
}

/// Returns the weight class of a row. Rows near the root and at the tip have classes of their own, because
/// they move differently.
uint32_t motion_class(const Layout& layout, uint32_t v);

/// Rows of floats that hold the features of one axis, those of neighbours at the neighbour's place. Absent
/// features point to zeros. "Now" of the own row is valid once its block is stored.
using FeatureRows = std::array<const float*, kHeadFeature>;
FeatureRows feature_rows(const Layout& layout, const History& history, const Frame& frame, size_t axis,
                         uint32_t v);

struct LastAndBase {
  const int32_t* last;
  const int32_t* base;
};
/// Computes (last - base) + weighted features for sum.size() places, which are whole blocks. It is a separate
/// pass because it waits for no other place; the rest of the prediction is one dependent chain per block.
STRANDCAST_LANES void sum_rows(const FeatureRows& rows, const FloatWeights& weights,
                               const LastAndBase& positions, std::span<float> sum) {
  for (size_t i = 0; i < sum.size(); i += kLaneCount) {
    Lanes block =
        to_floats(wrapping_differences(load_lanes(positions.last + i), load_lanes(positions.base + i)));
    for (uint32_t k = 0; k < kOwnFeatureCount; ++k) block += weights[k] * load_lanes(rows[k] + i);
    store_lanes(block, sum.data() + i);
  }
}

/// Integers of a block's vertices.
struct CodeLanes {
  IntLanes first{};
  IntLanes second{};
  IntLanes length{};
};

/// fold_sign() and unfold_sign() over lanes.
STRANDCAST_LANES UintLanes fold_lanes(const IntLanes& value) {
  const UintLanes negated = 0u - (UintLanes)value;
  return (negated << 1) ^ (0u - (negated >> 31));
}
STRANDCAST_LANES IntLanes unfold_lanes(const UintLanes& folded) {
  const UintLanes negated = (folded >> 1) ^ (0u - (folded & 1u));
  return (IntLanes)(0u - negated);
}

STRANDCAST_LANES CodeLanes sum_of(const CodeLanes& a, const CodeLanes& b) {
  return {wrapping_sums(a.first, b.first), wrapping_sums(a.second, b.second),
          wrapping_sums(a.length, b.length)};
}

/// Lattice position of an escaped vertex, and the escape that codes it.
using Lattice = std::array<int32_t, 3>;
Escape make_escape(size_t at, const Lattice& target, const Lattice& from, int32_t step = kEscapeStep);
Lattice escaped(const Escape& escape, const Lattice& from, int32_t step = kEscapeStep);
/// Step of the escapes of an anchor.
constexpr int32_t escape_step(float anchor_share) {
  return static_cast<int32_t>(anchor_share * static_cast<float>(kEscapeStep));
}

/// Positions of a block, addressable vertex by vertex.
struct BlockPositions {
  int32_t axis[3][kLaneCount];

  STRANDCAST_LANES explicit BlockPositions(const IntLaneVectors& from) {
    for (size_t i = 0; i < 3; ++i) store_lanes(from.axis[i], axis[i]);
  }
  Lattice get(size_t lane) const { return {axis[0][lane], axis[1][lane], axis[2][lane]}; }
  void set(size_t lane, const Lattice& point) {
    for (size_t i = 0; i < 3; ++i) axis[i][lane] = point[i];
  }
  STRANDCAST_LANES IntLaneVectors load() const {
    return {load_lanes(axis[0]), load_lanes(axis[1]), load_lanes(axis[2])};
  }
};

/// Predicted position of a block's vertices: `length` along the direction `along` from `base`, with two
/// directions across.
struct Expected {
  IntLaneVectors base;
  LaneVectors along;
  LaneVectors first;
  LaneVectors second;
  Lanes length;
  float tangent_step = kTangentStep;
  float length_step = kLengthStep;

  /// Makes steps smaller.
  STRANDCAST_LANES void refine(float share) {
    tangent_step = share * kTangentStep;
    length_step = share * kLengthStep;
  }
  /// Sets direction and length to those of `edge`.
  STRANDCAST_LANES void aim(const LaneVectors& edge) {
    const Lanes squared = dots(edge, edge);
    length = square_roots(squared);
    const Lanes scale = squared > kTinySquared ? 1.0f / length : Lanes{};
    for (size_t axis = 0; axis < 3; ++axis) {
      const Lanes instead = Lanes{} + (axis == 1 ? 1.0f : 0.0f);  // where there is no direction
      along.axis[axis] = scale != 0.0f ? edge.axis[axis] * scale : instead;
    }
    find_frames();
  }

  /// Computes the directions across `along`: an orthonormal basis without branches (Duff et al. 2017,
  /// Building an Orthonormal Basis, Revisited).
  STRANDCAST_LANES void find_frames() {
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

  /// Coordinates of an edge before rounding; `is_possible` is false where integers cannot express the edge.
  struct Coordinates {
    Lanes first;
    Lanes second;
    Lanes length;
    IntLanes is_possible;
  };
  STRANDCAST_LANES Coordinates coordinates(const LaneVectors& edge) const {
    constexpr float kSteepest = 0.2f;
    constexpr float kFarthest = 1e5f;
    const Lanes beside = dots(edge, along);
    const Lanes size = square_roots(dots(edge, edge));
    // Seen from the vertex before, where the direction of the edge meets the tangent plane.
    const Lanes scale = size > 0.0f ? length / beside / tangent_step : Lanes{};
    Coordinates of;
    of.first = dots(edge, first) * scale;
    of.second = dots(edge, second) * scale;
    of.length = (size - length) / length_step;
    const IntLanes is_steep = (size > 0.0f) & ~(beside > kSteepest * size);
    of.is_possible = ~is_steep & (sizes_of(of.first) < kFarthest) & (sizes_of(of.second) < kFarthest) &
                     (sizes_of(of.length) < kFarthest);
    return of;
  }
  /// Returns the integers nearest to the position that `other` predicts from the same base.
  STRANDCAST_LANES CodeLanes codes_of(const Expected& other) const {
    LaneVectors edge;
    for (size_t axis = 0; axis < 3; ++axis) edge.axis[axis] = other.along.axis[axis] * other.length;
    const Coordinates of = coordinates(edge);
    CodeLanes codes;
    codes.first = of.is_possible ? nearest_lanes(of.first) : IntLanes{};
    codes.second = of.is_possible ? nearest_lanes(of.second) : IntLanes{};
    codes.length = of.is_possible ? nearest_lanes(of.length) : IntLanes{};
    return codes;
  }

  /// Returns the positions that integers decode to, clamped to the range where rounding holds.
  STRANDCAST_LANES IntLaneVectors placed(const CodeLanes& codes) const {
    const Lanes across = to_floats(codes.first) * tangent_step;
    const Lanes also = to_floats(codes.second) * tangent_step;
    LaneVectors edge;
    for (size_t axis = 0; axis < 3; ++axis)
      edge.axis[axis] = (along.axis[axis] * length + first.axis[axis] * across) + second.axis[axis] * also;
    const Lanes squared = dots(edge, edge);
    const Lanes wanted = length + to_floats(codes.length) * length_step;
    const Lanes scale = squared > kTinySquared ? wanted / square_roots(squared) : Lanes{};
    IntLaneVectors position;
    for (size_t axis = 0; axis < 3; ++axis)
      position.axis[axis] = wrapping_sums(base.axis[axis], nearest_lanes(edge.axis[axis] * scale));
    return position;
  }
};

/// For each quantity of the past, the own feature nearest to the tip; rows nearer to the root have not read
/// it.
inline constexpr auto kFarthestFeatures = [] {
  std::array<size_t, 5> farthest{};
  for (size_t k = 0; k < kOwnFeatureCount; ++k) {
    if (kMotionFeatures[k].quantity == MotionQuantity::Now) continue;
    size_t& best = farthest[static_cast<size_t>(kMotionFeatures[k].quantity) - 1];
    if (kMotionFeatures[best].quantity != kMotionFeatures[k].quantity ||
        kMotionFeatures[best].tipward < kMotionFeatures[k].tipward)
      best = k;
  }
  return farthest;
}();

/// One row of all slices. It holds only pointers and numbers, which stores into planes cannot change.
class MotionRow {
 public:
  MotionRow(const Layout& layout, const History& history, Frame& frame, uint32_t v)
      : vertex_(v),
        stride_(layout.stride),
        begin_(v * static_cast<size_t>(layout.stride)),
        by_(frame.motion[motion_class(layout, v)]),
        length_blend_(static_cast<float>(frame.length_blend) * kLengthWeight),
        quantum_m_(history.quantum_m),
        presence_(layout.presence.data()),
        rest_length_m_(layout.rest_length_m.data() + begin_) {
    for (size_t axis = 0; axis < 3; ++axis) {
      features_[axis] = feature_rows(layout, history, frame, axis, v);
      last_[axis] = history.lattice[axis].data() + begin_;
      now_[axis] = frame.lattice[axis].data() + begin_;
      base_[axis] = v == 0 ? frame.zero_lattice.data() : now_[axis] - stride_;
      edge_[axis] = frame.edge[axis].data();
      velocity_[axis] = frame.velocity[axis].data() + begin_;
      residual_[axis] = frame.residual[axis].data() + begin_;
      last_drift_[axis] = history.drift[axis].data() + begin_;
      drift_[axis] = frame.drift[axis].data() + begin_;
    }
    for (size_t which = 0; which < 2; ++which) {
      neighbour_[which] = layout.neighbour[which].data();
      for (size_t axis = 0; axis < 3; ++axis)
        neighbour_sum_[which][axis] = frame.neighbour_sum[which][axis].data();
    }
  }

  uint32_t vertex() const { return vertex_; }
  /// Index into a plane of a place in this row.
  size_t at(size_t place) const { return begin_ + place; }

  /// Sums the whole-row features for `count` places; call it before their blocks are predicted.
  STRANDCAST_LANES void sum_features(size_t begin, size_t count) const {
    for (size_t axis = 0; axis < 3; ++axis) {
      FeatureRows rows = features_[axis];
      for (const float*& row : rows) row += begin;
      sum_rows(rows, by_.weights, {last_[axis] + begin, base_[axis] + begin}, {edge_[axis] + begin, count});
    }
  }

  /// Prefetches what the next row reads around a place; its data is too scattered for the hardware
  /// prefetcher.
  STRANDCAST_LANES void prefetch_next(size_t place) const {
    constexpr size_t kPlacesInLine = 16;
    if (place % kPlacesInLine != 0) return;
    for (size_t axis = 0; axis < 3; ++axis) {
      for (const size_t k : kFarthestFeatures) __builtin_prefetch(features_[axis][k] + stride_ + place);
      __builtin_prefetch(last_[axis] + stride_ + place);
    }
  }

  /// Predicts the block at `place`; blocks of a slice come in order.
  STRANDCAST_LANES void expect(size_t place, Expected& expected) const {
    LaneVectors last;
    for (size_t axis = 0; axis < 3; ++axis) last.axis[axis] = to_floats(load_lanes(last_[axis] + place));
    const Lanes presence = load_lanes(presence_ + place);
    LaneVectors edge;
    for (size_t axis = 0; axis < 3; ++axis) {
      expected.base.axis[axis] = load_lanes(base_[axis] + place);
      const auto& head = by_.head[axis];
      const Lanes turned = (head[0] * last.axis[0] + head[1] * last.axis[1]) + head[2] * last.axis[2];
      edge.axis[axis] = load_lanes(edge_[axis] + place) + (turned + head[3] * presence);
      for (uint32_t which = 0; which < 2; ++which)
        edge.axis[axis] += gather_lanes(neighbour_sum_[which][axis], neighbour_[which] + place);
    }
    expected.aim(edge);
    if (vertex_ != 0) expected.length = known_length(place);
  }

  /// Stores the positions of a block and the values derived from them.
  STRANDCAST_LANES void store(const Expected& expected, size_t place, const IntLaneVectors& position) const {
    for (size_t axis = 0; axis < 3; ++axis) {
      const IntLanes now = position.axis[axis];
      const Lanes velocity = to_floats(wrapping_differences(now, load_lanes(last_[axis] + place)));
      const Lanes edge = to_floats(wrapping_differences(now, expected.base.axis[axis]));
      store_lanes(now, now_[axis] + place);
      store_lanes(velocity, velocity_[axis] + place);
      store_lanes(edge - expected.along.axis[axis] * expected.length, residual_[axis] + place);
      store_lanes(kDriftShare * load_lanes(last_drift_[axis] + place) + velocity, drift_[axis] + place);
      // What later blocks add for this neighbour.
      store_neighbour_sum<MotionStrand::Neighbour>(axis, place, velocity);
      store_neighbour_sum<MotionStrand::SecondNeighbour>(axis, place, velocity);
    }
  }

  /// Returns the last positions of a block's vertices, which escapes count from.
  STRANDCAST_LANES IntLaneVectors last(size_t place) const {
    return {load_lanes(last_[0] + place), load_lanes(last_[1] + place), load_lanes(last_[2] + place)};
  }

 private:
  template <MotionStrand strand>
  STRANDCAST_LANES void store_neighbour_sum(size_t axis, size_t place, const Lanes& velocity) const {
    constexpr uint32_t kFirst = first_feature_of(strand);
    static_assert(kMotionFeatures[kFirst].quantity == MotionQuantity::Now &&
                  kMotionFeatures[kFirst].tipward == 0);
    constexpr uint32_t kEnd = kFirst + feature_count_of(strand);
    Lanes sum = by_.weights[kFirst] * velocity;
    for (uint32_t k = kFirst + 1; k < kEnd; ++k)
      sum += by_.weights[k] * load_lanes(features_[axis][k] + place);
    constexpr size_t kWhich = strand == MotionStrand::Neighbour ? 0 : 1;
    store_lanes(sum, neighbour_sum_[kWhich][axis] + place);
  }
  /// Returns the known lengths of the segments that end at this place, in lattice steps. Not for roots.
  STRANDCAST_LANES Lanes known_length(size_t place) const {
    const Lanes rest = load_lanes(rest_length_m_ + place) / quantum_m_;
    if (length_blend_ == 0.0f) return rest;
    LaneVectors edge;
    for (size_t axis = 0; axis < 3; ++axis) {
      const int32_t* own = last_[axis] + place;
      edge.axis[axis] = to_floats(wrapping_differences(load_lanes(own), load_lanes(own - stride_)));
    }
    return rest + length_blend_ * (square_roots(dots(edge, edge)) - rest);
  }

  uint32_t vertex_;
  size_t stride_;
  size_t begin_;
  MotionClass by_;
  float length_blend_;
  float quantum_m_;
  std::array<FeatureRows, 3> features_;
  std::array<const int32_t*, 3> last_;
  std::array<const int32_t*, 3> base_;  // decoded positions of the parents
  std::array<int32_t*, 3> now_;
  std::array<float*, 3> edge_;
  std::array<float*, 3> velocity_;
  std::array<float*, 3> residual_;
  std::array<const float*, 3> last_drift_;
  std::array<float*, 3> drift_;
  std::array<std::array<float*, 3>, 2> neighbour_sum_;
  std::array<const uint32_t*, 2> neighbour_;
  const float* presence_;
  const float* rest_length_m_;
};

/// Visits a slice block by block, roots first: work(row, place, moved). `moved` is the position that the
/// motion predicts; `work` stores the final one.
template <class Work>
STRANDCAST_LANES void for_each_block(const SliceWork& of, Work work) {
  const size_t begin = of.layout.slice_begin[of.slice];
  const size_t end = of.layout.slice_begin[of.slice + 1];
  for (uint32_t v = 0; v < of.layout.vertex_count; ++v) {
    const MotionRow row(of.layout, of.history, of.frame, v);
    row.sum_features(begin, end - begin);
    for (size_t place = begin; place < end; place += kLaneCount) {
      Expected moved;
      row.expect(place, moved);
      work(row, place, moved);
      row.prefetch_next(place);
    }
  }
}

}  // namespace strandcast::tangent
