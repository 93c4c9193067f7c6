// What the encoder of the "tangent" codec decides: weights for a frame, and the cheapest integers that keep
// every vertex within the bound.
#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "common/strands/least_squares.h"
#include "common/strands/tangent/shape.h"
#include "common/strands/wrapping.h"

namespace strandcast::tangent {
namespace {

// What is left of the bound when positions were rounded to the lattice (sqrt(3) / 2) and to floats before.
constexpr int32_t kReach = kStepsPerBound - 3;

/// The cheapest integers that put vertices within reach of their targets. Cheap are those near `origin`: a
/// dead zone as wide as the bound allows.
struct Found {
  const Expected& expected;
  const IntLaneVectors& target;
  CodeLanes origin{};
  IntLanes is_open{};  // worth trying
  IntLanes is_found{};
  CodeLanes codes{};
  IntLaneVectors position{};

  /// How far the integers are from the origin, unless escaped.
  STRANDCAST_INLINE CodeLanes apart() const {
    return {is_found ? wrapping_differences(codes.first, origin.first) : codes.first,
            is_found ? wrapping_differences(codes.second, origin.second) : codes.second,
            is_found ? wrapping_differences(codes.length, origin.length) : codes.length};
  }

  /// Takes these integers for open lanes in which they reach the target.
  STRANDCAST_INLINE void consider(const CodeLanes& tried) {
    const IntLaneVectors reached = expected.placed(tried);
    LaneVectors away;
    for (size_t axis = 0; axis < 3; ++axis)
      away.axis[axis] = to_floats(wrapping_differences(reached.axis[axis], target.axis[axis]));
    // Exact: squares this small are whole numbers below 2^24, and larger ones stay larger.
    const IntLanes is_taken = is_open & (dots(away, away) <= static_cast<float>(kReach * kReach));
    codes.first = is_taken ? tried.first : codes.first;
    codes.second = is_taken ? tried.second : codes.second;
    codes.length = is_taken ? tried.length : codes.length;
    for (size_t axis = 0; axis < 3; ++axis)
      position.axis[axis] = is_taken ? reached.axis[axis] : position.axis[axis];
    is_found |= is_taken;
    is_open &= ~is_taken;
  }
};

/// Coordinates across the segment, whole numbers around them: towards the origin, and away from it.
struct Corners {
  IntLanes low_a;
  IntLanes low_b;
  IntLanes high_a;
  IntLanes high_b;
  IntLanes is_a_farther;

  STRANDCAST_INLINE Corners(const Expected::Coordinates& of, const CodeLanes& origin) {
    const IntLanes one = IntLanes{} + 1;
    const Lanes a = of.first - to_floats(origin.first);
    const Lanes b = of.second - to_floats(origin.second);
    const IntLanes whole_a = to_integers(a);
    const IntLanes whole_b = to_integers(b);
    low_a = wrapping_sums(origin.first, whole_a);
    low_b = wrapping_sums(origin.second, whole_b);
    high_a = wrapping_sums(low_a, a < 0.0f ? -one : one);
    high_b = wrapping_sums(low_b, b < 0.0f ? -one : one);
    is_a_farther = sizes_of(a - to_floats(whole_a)) > sizes_of(b - to_floats(whole_b));
  }

  /// Towards the origin first: the corner of the cell nearest to it, then its sides, then opposite.
  STRANDCAST_INLINE void try_with(const IntLanes& correction, Found& found) const {
    found.consider({low_a, low_b, correction});
    if (!is_any(found.is_open)) return;
    found.consider({is_a_farther ? high_a : low_a, is_a_farther ? low_b : high_b, correction});
    if (!is_any(found.is_open)) return;
    found.consider({is_a_farther ? low_a : high_a, is_a_farther ? high_b : low_b, correction});
    if (!is_any(found.is_open)) return;
    found.consider({high_a, high_b, correction});
  }
};

STRANDCAST_INLINE void find_codes(Found& found) {
  LaneVectors edge;
  for (size_t axis = 0; axis < 3; ++axis)
    edge.axis[axis] =
        to_floats(wrapping_differences(found.target.axis[axis], found.expected.base.axis[axis]));
  const Expected::Coordinates of = found.expected.coordinates(edge);
  const Corners corners(of, found.origin);
  constexpr float kAsIs = 1.3f;  // length steps that the cell may do without a correction
  const IntLanes rounded = nearest_lanes(of.length);
  const IntLanes is_near = sizes_of(of.length - to_floats(found.origin.length)) <= kAsIs;
  found.is_open = of.is_possible;
  corners.try_with(is_near ? found.origin.length : rounded, found);
  found.is_open &= is_near & (rounded != found.origin.length);
  if (is_any(found.is_open)) corners.try_with(rounded, found);
}

/// Escapes the vertices of the block that begins at `at` for which nothing was found; from(lane) is where
/// their escapes count from.
template <class From>
STRANDCAST_INLINE void escape_others(Found& found, size_t at, std::vector<Escape>& escapes, From from) {
  if (!is_any(~found.is_found)) return;
  for (uint32_t lane = 0; lane < kLaneCount; ++lane) {
    if (found.is_found[lane] != 0) continue;
    escapes.push_back(make_escape(at + lane, lane_of(found.target, lane), from(lane)));
    found.codes.first[lane] = 0;
    found.codes.second[lane] = 0;
    found.codes.length[lane] = kEscapedLength;
    const Lattice point = escaped(escapes.back(), from(lane));
    for (size_t axis = 0; axis < 3; ++axis) found.position.axis[axis][lane] = point[axis];
  }
}

STRANDCAST_INLINE IntLaneVectors load_vectors(const Planes<int32_t>& planes, size_t at) {
  IntLaneVectors vectors;
  for (size_t axis = 0; axis < 3; ++axis) vectors.axis[axis] = load_lanes(planes[axis].data() + at);
  return vectors;
}

STRANDCAST_INLINE void store_codes(const CodeLanes& codes, Codes& to, size_t at) {
  store_lanes(codes.first, to.first.data() + at);
  store_lanes(codes.second, to.second.data() + at);
  store_lanes(codes.length, to.length.data() + at);
}

constexpr size_t kSampleStrands = 768;
constexpr size_t kRun = 4;      // side by side in memory: one of them alone would fetch as much
constexpr double kNoise = 8.0;  // steps; a thirtieth of the bound is not worth predicting
// Samples are made of true positions. What is decoded in their place lies 0.63 bounds beside them along two
// axes of three: 93 steps for each, of which a part is shared with the wanted position.
constexpr double kNoiseNow = 80.0;

/// Strands to fit to: runs at even distances.
std::vector<uint32_t> sample_places(const Layout& layout) {
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
  SampleRow(const Layout& layout, const History& history, const Planes<int32_t>& target, const Frame& frame,
            uint32_t v)
      : layout_(layout), history_(history), target_(target), frame_(frame), v_(v) {
    for (size_t axis = 0; axis < 3; ++axis) rows_[axis] = feature_rows(layout, history, frame, axis, v);
  }

  size_t at(size_t place) const { return v_ * size_t{layout_.stride} + place; }

  /// What is to become the change of position of the vertex so far from this row.
  float now(size_t axis, size_t place, int tipward) const {
    if (tipward < 0 && v_ < static_cast<uint32_t>(-tipward)) return 0.0f;
    const size_t at = (v_ - static_cast<uint32_t>(-tipward)) * size_t{layout_.stride} + place;
    return static_cast<float>(wrapping_difference(target_[axis][at], history_.lattice[axis][at]));
  }

  std::array<float, kMotionFeatureCount> features(size_t axis, size_t place) const {
    std::array<float, kMotionFeatureCount> value;
    set_features(value, axis, place, std::make_index_sequence<kMotionFeatures.size()>());
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
    constexpr float kTypical = 300.0f;  // steps
    float squares = 0.0f;
    for (size_t axis = 0; axis < 3; ++axis) {
      const float own = history_.residual[axis][at(place)];
      const float child =
          v_ + 1 < layout_.vertex_count ? history_.residual[axis][at(place) + layout_.stride] : 0.0f;
      squares += own * own + child * child;
    }
    return 1.0f / std::sqrt(1.0f + squares / (kTypical * kTypical));
  }

 private:
  // The table is read while compiling: one load and no branch for each feature.
  template <size_t... k>
  void set_features(std::array<float, kMotionFeatureCount>& value, size_t axis, size_t place,
                    std::index_sequence<k...>) const {
    ((value[k] = feature<kMotionFeatures[k].quantity, kMotionFeatures[k].tipward>(
          axis, k, place_of(kMotionFeatures[k].strand, place))),
     ...);
  }
  template <MotionQuantity quantity, int tipward>
  float feature(size_t axis, size_t k, size_t place) const {
    if constexpr (quantity == MotionQuantity::Now) return now(axis, place, tipward);
    return rows_[axis][k][place];
  }
  size_t place_of(MotionStrand strand, size_t place) const {
    if (strand == MotionStrand::Own) return place;
    return layout_.neighbour[strand == MotionStrand::Neighbour ? 0 : 1][place];
  }

  const Layout& layout_;
  const History& history_;
  const Planes<int32_t>& target_;
  const Frame& frame_;
  uint32_t v_;
  std::array<FeatureRows, 3> rows_;
};

std::array<double, kMotionFeatureCount> feature_noise() {
  std::array<double, kMotionFeatureCount> noise;
  noise.fill(kNoise);
  for (size_t k = 0; k < kMotionFeatures.size(); ++k)
    if (kMotionFeatures[k].quantity == MotionQuantity::Now) noise[k] = kNoiseNow;
  return noise;
}

void add_row(const SampleRow& row, std::span<const uint32_t> sample, LeastSquares<kMotionFeatureCount>& fit) {
  for (const uint32_t place : sample) {
    const float trust = row.trust(place);
    for (size_t axis = 0; axis < 3; ++axis) {
      fit.add(row.features(axis, place), row.now(axis, place, 0), trust);
    }
  }
  fit.flush();
}

/// Share of the last decoded length that predicts the next one best, in 1/16.
uint8_t fit_length_blend(const Layout& layout, const History& history, const Planes<int32_t>& target,
                         std::span<const uint32_t> sample) {
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

void fit_motion(const Layout& layout, const History& history, const Planes<int32_t>& target,
                WorkerPool& workers, Frame& frame) {
  const std::vector<uint32_t> sample = sample_places(layout);
  frame.length_blend = fit_length_blend(layout, history, target, sample);
  for_each_part(encode_terms(layout, workers), motion_class_count(layout), [&](uint32_t c) {
    LeastSquares<kMotionFeatureCount> fit;
    for (uint32_t v = 0; v < layout.vertex_count; ++v)
      if (motion_class(layout, v) == c) add_row({layout, history, target, frame, v}, sample, fit);
    frame.weights[c] = fit.weights(kMotionWeight, feature_noise());
  });
  frame.apply_weights();
}

void quantise_slice(const Layout& layout, const History& history, const Planes<int32_t>& target,
                    uint32_t slice, Frame& frame) {
  for_each_block(layout, history, slice, frame,
                 [&](const MotionRow& row, size_t place, const Expected& moved) {
                   const size_t at = row.at(place);
                   const IntLaneVectors wanted = load_vectors(target, at);
                   Found found{moved, wanted};
                   find_codes(found);
                   escape_others(found, at, frame.codes.escapes[slice],
                                 [&](uint32_t lane) { return row.last(at + lane); });
                   store_codes(found.codes, frame.codes, at);
                   row.store(moved, place, found.position);
                 });
}

void quantise_anchor(const Layout& layout, const History& history, const Planes<int32_t>& target,
                     uint32_t slice, Frame& frame) {
  for_each_block(layout, history, slice, frame,
                 [&](const MotionRow& row, size_t place, const Expected& moved) {
                   const ShapeRow shape(layout, history.quantum_m, frame.lattice, row.vertex());
                   const Expected expected = shape.expect(place, frame.shape_weights);
                   const size_t at = row.at(place);
                   const IntLaneVectors wanted = load_vectors(target, at);
                   Found found{expected, wanted, expected.codes_of(moved)};
                   find_codes(found);
                   escape_others(found, at, frame.shape_codes.escapes[slice],
                                 [&](uint32_t lane) { return lane_of(expected.base, lane); });
                   store_codes(found.codes, frame.shape_codes, at);
                   store_codes(found.apart(), frame.codes, at);
                   row.store(moved, place, found.position);
                 });
  frame.codes.escapes[slice] = frame.shape_codes.escapes[slice];
}

}  // namespace strandcast::tangent
