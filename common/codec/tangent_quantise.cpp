// What the encoder of the "tangent" codec decides: weights for a frame, and the cheapest integers that keep
// every vertex within the bound.
#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "common/codec/least_squares.h"
#include "common/codec/tangent_row.h"
#include "common/codec/wrapping.h"

namespace strandcast {
namespace {

// What is left of the bound when positions were rounded to the lattice (sqrt(3) / 2) and to floats before.
constexpr int32_t kReach = kStepsPerBound - 3;

/// The cheapest integers that put vertices within reach of their targets. Cheap are small ones: a dead zone
/// as wide as the bound allows.
struct Found {
  const Expected& expected;
  const IntLaneVectors& target;
  IntLanes is_open{};  // worth trying
  IntLanes is_found{};
  IntLanes first{};
  IntLanes second{};
  IntLanes length{};
  IntLaneVectors position{};

  /// Takes these integers for open lanes in which they reach the target.
  STRANDCAST_INLINE void consider(const IntLanes& a, const IntLanes& b, const IntLanes& correction) {
    const IntLaneVectors reached = expected.placed(a, b, correction);
    LaneVectors away;
    for (size_t axis = 0; axis < 3; ++axis)
      away.axis[axis] = to_floats(wrapping_differences(reached.axis[axis], target.axis[axis]));
    // Exact: squares this small are whole numbers below 2^24, and larger ones stay larger.
    const IntLanes is_taken = is_open & (dots(away, away) <= static_cast<float>(kReach * kReach));
    first = is_taken ? a : first;
    second = is_taken ? b : second;
    length = is_taken ? correction : length;
    for (size_t axis = 0; axis < 3; ++axis)
      position.axis[axis] = is_taken ? reached.axis[axis] : position.axis[axis];
    is_found |= is_taken;
    is_open &= ~is_taken;
  }
};

/// Coordinates across the segment, whole numbers around them: towards zero, and away from it.
struct Corners {
  IntLanes low_a;
  IntLanes low_b;
  IntLanes high_a;
  IntLanes high_b;
  IntLanes is_a_farther;

  STRANDCAST_INLINE Corners(const Lanes& a, const Lanes& b) {
    const IntLanes one = IntLanes{} + 1;
    low_a = to_integers(a);
    low_b = to_integers(b);
    high_a = wrapping_sums(low_a, a < 0.0f ? -one : one);
    high_b = wrapping_sums(low_b, b < 0.0f ? -one : one);
    is_a_farther = sizes_of(a - to_floats(low_a)) > sizes_of(b - to_floats(low_b));
  }

  /// Towards zero first: the corner of the cell nearest to the expectation, then its sides, then opposite.
  STRANDCAST_INLINE void try_with(const IntLanes& correction, Found& found) const {
    found.consider(low_a, low_b, correction);
    if (!is_any(found.is_open)) return;
    found.consider(is_a_farther ? high_a : low_a, is_a_farther ? low_b : high_b, correction);
    if (!is_any(found.is_open)) return;
    found.consider(is_a_farther ? low_a : high_a, is_a_farther ? high_b : low_b, correction);
    if (!is_any(found.is_open)) return;
    found.consider(high_a, high_b, correction);
  }
};

STRANDCAST_INLINE void find_codes(Found& found) {
  const Expected& expected = found.expected;
  LaneVectors edge;
  for (size_t axis = 0; axis < 3; ++axis)
    edge.axis[axis] = to_floats(wrapping_differences(found.target.axis[axis], expected.base.axis[axis]));
  const Lanes along = dots(edge, expected.along);
  const Lanes length = square_roots(dots(edge, edge));
  const Lanes beyond = (length - expected.length) / kLengthStep;
  // Seen from the vertex before, coordinates where the direction to the target meets the tangent plane.
  constexpr float kSteepest = 0.2f;
  const Lanes scale = length > 0.0f ? expected.length / along / kTangentStep : Lanes{};
  const Lanes a = dots(edge, expected.first) * scale;
  const Lanes b = dots(edge, expected.second) * scale;
  constexpr float kFarthest = 1e5f;
  const IntLanes is_steep = (length > 0.0f) & ~(along > kSteepest * length);
  const IntLanes is_possible =
      ~is_steep & (sizes_of(a) < kFarthest) & (sizes_of(b) < kFarthest) & (sizes_of(beyond) < kFarthest);
  const Corners corners(a, b);
  constexpr float kAsIs = 1.3f;  // length steps that the cell may do without a correction
  const IntLanes rounded = nearest_lanes(beyond);
  const IntLanes is_near = sizes_of(beyond) <= kAsIs;
  found.is_open = is_possible;
  corners.try_with(is_near ? IntLanes{} : rounded, found);
  found.is_open &= is_near & (rounded != 0);
  if (is_any(found.is_open)) corners.try_with(rounded, found);
}

STRANDCAST_INLINE void quantise_block(const MotionRow& row, const Planes<int32_t>& target, size_t place,
                                      std::vector<Escape>& escapes) {
  Expected expected;
  row.expect(place, expected);
  const size_t at = row.at(place);
  IntLaneVectors wanted;
  for (size_t axis = 0; axis < 3; ++axis) wanted.axis[axis] = load_lanes(target[axis].data() + at);
  Found found{expected, wanted};
  find_codes(found);
  if (is_any(~found.is_found)) {
    for (uint32_t lane = 0; lane < kLaneCount; ++lane) {
      if (found.is_found[lane] != 0) continue;
      escapes.push_back(
          row.make_escape(at + lane, {target[0][at + lane], target[1][at + lane], target[2][at + lane]}));
      found.first[lane] = 0;
      found.second[lane] = 0;
      found.length[lane] = kEscapedLength;
      const auto point = row.escaped(escapes.back());
      for (size_t axis = 0; axis < 3; ++axis) found.position.axis[axis][lane] = point[axis];
    }
  }
  store_lanes(found.first, row.frame().first.data() + at);
  store_lanes(found.second, row.frame().second.data() + at);
  store_lanes(found.length, row.frame().length.data() + at);
  row.store(expected, place, found.position);
}

constexpr size_t kSampleStrands = 384;
constexpr size_t kRun = 4;      // side by side in memory: one of them alone would fetch as much
constexpr double kNoise = 8.0;  // steps; a thirtieth of the bound is not worth predicting

/// Strands to fit to: runs at even distances.
std::vector<uint32_t> sample_places(const TangentLayout& layout) {
  const size_t step = kRun * std::max<size_t>(1, layout.stride / kSampleStrands);
  std::vector<uint32_t> places;
  for (size_t run = step / 2 / kRun * kRun; run < layout.no_neighbour(); run += step)
    for (size_t place = run; place < run + kRun; ++place)
      if (layout.strand_at[place] != kNoStrand) places.push_back(static_cast<uint32_t>(place));
  return places;
}

/// The vertices of a row as samples: like MotionRow, but with `target` in place of what is yet to be decoded.
class SampleRow {
 public:
  SampleRow(const TangentLayout& layout, const TangentHistory& history, const Planes<int32_t>& target,
            const TangentFrame& frame, uint32_t v)
      : layout_(layout), history_(history), target_(target), frame_(frame), v_(v) {
    for (size_t axis = 0; axis < 3; ++axis) rows_[axis] = feature_rows(layout, history, frame, axis, v);
  }

  size_t at(size_t place) const { return v_ * size_t{layout_.stride} + place; }

  float now(size_t axis, size_t at) const {
    return static_cast<float>(wrapping_difference(target_[axis][at], history_.lattice[axis][at]));
  }

  std::array<float, kMotionFeatureCount> features(size_t axis, size_t place) const {
    const FeatureRows& rows = rows_[axis];
    std::array<float, kMotionFeatureCount> value;
    for (uint32_t k = 0; k < kRowFeatureCount; ++k) value[k] = rows[k][place];
    value[kParentNow] = ancestor_now(axis, 1, place);
    value[kGrandparentNow] = ancestor_now(axis, 2, place);
    value[kGreatGrandparentNow] = ancestor_now(axis, 3, place);
    const auto [neighbour, second] = std::pair(layout_.neighbour[0][place], layout_.neighbour[1][place]);
    value[kNeighbourFeature] = now(axis, at(neighbour));
    value[kNeighbourFeature + 1] = rows[kOwnThen][neighbour];
    value[kNeighbourFeature + 2] = rows[kOwnResidual][neighbour];
    value[kNeighbourFeature + 3] = ancestor_now(axis, 1, neighbour);
    value[kSecondNeighbourFeature] = now(axis, at(second));
    value[kSecondNeighbourFeature + 1] = ancestor_now(axis, 1, second);
    for (uint32_t k = 0; k < kHeadStepCount; ++k) {
      const auto& step = frame_.head.step[k].row[axis];
      double change = step[3];
      for (size_t i = 0; i < 3; ++i) change += step[i] * history_.lattice[i][at(place)];
      value[kHeadFeature + k] = static_cast<float>(change);
    }
    return value;
  }

  /// Vertices that were predicted badly would rule the sums, though they need few bits more than others.
  float trust(size_t place) const {
    constexpr float kTypical = 600.0f;  // steps
    float squares = 0.0f;
    for (size_t axis = 0; axis < 3; ++axis) {
      const float own = rows_[axis][kOwnResidual][place];
      const float child = rows_[axis][kChildResidual][place];
      squares += own * own + child * child;
    }
    return 1.0f / std::sqrt(1.0f + squares / (kTypical * kTypical));
  }

 private:
  float ancestor_now(size_t axis, uint32_t generations, size_t place) const {
    if (v_ < generations) return 0.0f;
    return now(axis, at(place) - generations * size_t{layout_.stride});
  }

  const TangentLayout& layout_;
  const TangentHistory& history_;
  const Planes<int32_t>& target_;
  const TangentFrame& frame_;
  uint32_t v_;
  std::array<FeatureRows, 3> rows_;
};

/// Share of the last decoded length that predicts the next one best, in 1/16.
uint8_t fit_length_blend(const TangentLayout& layout, const TangentHistory& history,
                         const Planes<int32_t>& target, std::span<const uint32_t> sample) {
  double numerator = 0.0;
  double denominator = 0.0;
  for (uint32_t v = 1; v < layout.vertex_count; ++v) {
    for (const uint32_t place : sample) {
      const size_t at = v * static_cast<size_t>(layout.stride) + place;
      double now = 0.0;
      double then = 0.0;
      for (size_t axis = 0; axis < 3; ++axis) {
        const double edge_now = static_cast<double>(target[axis][at]) - target[axis][at - layout.stride];
        const double edge_then =
            static_cast<double>(history.lattice[axis][at]) - history.lattice[axis][at - layout.stride];
        now += edge_now * edge_now;
        then += edge_then * edge_then;
      }
      const double rest = static_cast<double>(layout.rest_length_m[at]) / history.quantum_m;
      numerator += (std::sqrt(now) - rest) * (std::sqrt(then) - rest);
      denominator += (std::sqrt(then) - rest) * (std::sqrt(then) - rest);
    }
  }
  if (!(denominator > 0.0)) return 0;
  return static_cast<uint8_t>(std::lrint(std::clamp(numerator / denominator, 0.0, 1.0) / kLengthWeight));
}

}  // namespace

void fit_motion(const TangentLayout& layout, const TangentHistory& history, const Planes<int32_t>& target,
                TangentFrame& frame) {
  const std::vector<uint32_t> sample = sample_places(layout);
  frame.length_blend = fit_length_blend(layout, history, target, sample);
  std::array<LeastSquares<kMotionFeatureCount>, kMotionClassCount> fits;
  for (uint32_t v = 0; v < layout.vertex_count; ++v) {
    auto& fit = fits[motion_class(layout, v)];
    const SampleRow row(layout, history, target, frame, v);
    for (const uint32_t place : sample) {
      const float trust = row.trust(place);
      for (size_t axis = 0; axis < 3; ++axis) {
        std::array<float, kMotionFeatureCount> value = row.features(axis, place);
        for (float& one : value) one *= trust;
        fit.add(value, trust * row.now(axis, row.at(place)));
      }
    }
    fit.flush();
  }
  for (uint32_t c = 0; c < kMotionClassCount; ++c) frame.weights[c] = fits[c].weights(kMotionWeight, kNoise);
}

void quantise_slice(const TangentLayout& layout, const TangentHistory& history, const Planes<int32_t>& target,
                    uint32_t slice, TangentFrame& frame) {
  for (uint32_t v = 0; v < layout.vertex_count; ++v) {
    const MotionRow row(layout, history, frame, v);
    row.sum_features(slice);
    for (size_t place = layout.slice_begin[slice]; place < layout.slice_begin[slice + 1];
         place += kLaneCount) {
      quantise_block(row, target, place, frame.escapes[slice]);
    }
  }
}

}  // namespace strandcast
