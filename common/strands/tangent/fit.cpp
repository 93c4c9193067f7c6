// Weights that a frame of the "tangent" codec is predicted with: least squares over a sample of strands.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

#include "common/strands/least_squares.h"
#include "common/strands/tangent/row.h"

namespace strandcast::tangent {
namespace {

constexpr size_t kFitStrands = 768;
constexpr size_t kRun = 4;      // side by side in memory: one of them alone would fetch as much
constexpr double kNoise = 8.0;  // steps; a thirtieth of the bound is not worth predicting
// Samples are made of true positions. What is decoded in their place lies 0.63 bounds beside them along two
// axes of three: 93 steps for each, of which a part is shared with the wanted position.
constexpr double kNoiseNow = 80.0;

/// Strands to fit to: runs at even distances.
std::vector<uint32_t> sample_places(const Layout& layout) {
  const size_t step = kRun * std::max<size_t>(1, layout.stride / kFitStrands);
  std::vector<uint32_t> places;
  for (size_t run = step / 2 / kRun * kRun; run < layout.no_neighbour(); run += step)
    for (size_t place = run; place < run + kRun; ++place)
      if (layout.strand_at[place] != kNoStrand) places.push_back(static_cast<uint32_t>(place));
  return places;
}

std::array<double, kMotionFeatureCount> feature_noise() {
  std::array<double, kMotionFeatureCount> noise;
  noise.fill(kNoise);
  for (size_t k = 0; k < kMotionFeatures.size(); ++k)
    if (kMotionFeatures[k].quantity == MotionQuantity::Now) noise[k] = kNoiseNow;
  return noise;
}

/// Eight samples of a row. Where their places are up to three pieces of neighbouring ones, as they are nearly
/// always, each piece is loaded as if all eight were of it.
struct SampleEight {
  std::array<uint32_t, kLaneCount> place;  // zeros in every array for lanes that are no samples
  uint32_t count;                          // lanes that are samples
  bool are_pieces = true;
  std::array<uint32_t, 3> piece;  // place of the first lane, were all of the piece
  IntLanes is_second;
  IntLanes is_third;

  SampleEight(const Layout& layout, std::span<const uint32_t> sample, size_t i) {
    count = static_cast<uint32_t>(std::min<size_t>(kLaneCount, sample.size() - i));
    std::array<uint32_t, 4> begin = {0, kLaneCount, kLaneCount, kLaneCount};
    uint32_t pieces = 1;
    for (uint32_t lane = 0; lane < kLaneCount; ++lane) {
      place[lane] = lane < count ? sample[i + lane] : layout.no_neighbour() + lane;
      if (lane == 0 || place[lane] == place[lane - 1] + 1) continue;
      begin[std::min(pieces++, 3u)] = lane;
    }
    are_pieces = pieces <= piece.size();
    for (uint32_t k = 0; k < piece.size(); ++k)
      piece[k] = begin[k] < kLaneCount ? place[begin[k]] - begin[k] : piece[0];
    const IntLanes lane = {0, 1, 2, 3, 4, 5, 6, 7};
    is_second = lane >= static_cast<int32_t>(begin[1]);
    is_third = lane >= static_cast<int32_t>(begin[2]);
  }

  /// row[place] for each lane.
  template <bool are_in_pieces, class T>
  STRANDCAST_LANES auto take(const T* row) const {
    if constexpr (!are_in_pieces) {
      return gather_lanes(row, place.data());
    } else {
      const auto first = load_lanes(row + piece[0]);
      const auto second = load_lanes(row + piece[1]);
      const auto third = load_lanes(row + piece[2]);
      return is_third ? third : is_second ? second : first;
    }
  }
};

using WideDoubles = double __attribute__((vector_size(sizeof(double) * kLaneCount)));
using MotionFit = LeastSquares<kMotionFeatureCount>;

/// The vertices of a row as samples: like MotionRow, but with `target` in place of what is yet to be decoded.
class SampleRow {
 public:
  SampleRow(const Layout& layout, const History& history, const Planes<int32_t>& target, const Frame& frame,
            uint32_t v)
      : layout_(layout), frame_(frame) {
    for (size_t axis = 0; axis < 3; ++axis) {
      rows_[axis] = feature_rows(layout, history, frame, axis, v);
      for (uint32_t back = 0; back < kNowRows; ++back) {
        const size_t begin = (v - back) * size_t{layout.stride};
        now_[axis][back] = back > v ? frame.zero_lattice.data() : target[axis].data() + begin;
        last_[axis][back] = back > v ? frame.zero_lattice.data() : history.lattice[axis].data() + begin;
      }
      residual_[axis] = history.residual[axis].data() + v * size_t{layout.stride};
      child_residual_[axis] =
          v + 1 < layout.vertex_count ? residual_[axis] + layout.stride : frame.zeros.data();
    }
  }

  STRANDCAST_LANES void add(std::span<const SampleEight> sample, MotionFit& fit) const {
    for (size_t i = 0; i < sample.size(); ++i) {
      const SampleEight& eight = sample[i];
      if (i + kAhead < sample.size()) prefetch(sample[i + kAhead]);
      if (eight.are_pieces)
        add_eight<true>(eight, fit);
      else
        add_eight<false>(eight, fit);
    }
    fit.flush();
  }

 private:
  static constexpr uint32_t kNowRows = 4;  // the own one and those before it
  static constexpr size_t kAhead = 3;      // eights; samples lie too far apart for the processor to guess

  /// Prefetches what no row nearer to the root has read yet.
  STRANDCAST_LANES void prefetch(const SampleEight& eight) const {
    for (size_t axis = 0; axis < 3; ++axis) {
      for (const uint32_t place : eight.piece) {
        __builtin_prefetch(now_[axis][0] + place);
        __builtin_prefetch(last_[axis][0] + place);
        for (const size_t k : kFarthestFeatures) __builtin_prefetch(rows_[axis][k] + place);
      }
    }
  }

  /// Vertices that were predicted badly would rule the sums, though they need few bits more than others.
  template <bool are_pieces>
  STRANDCAST_LANES Lanes trust(const SampleEight& eight) const {
    constexpr float kTypical = 300.0f;  // steps
    Lanes squares{};
    for (size_t axis = 0; axis < 3; ++axis) {
      const Lanes own = eight.take<are_pieces>(residual_[axis]);
      const Lanes child = eight.take<are_pieces>(child_residual_[axis]);
      squares += own * own + child * child;
    }
    const Lanes all = 1.0f / square_roots(1.0f + squares / (kTypical * kTypical));
    IntLanes lane = {0, 1, 2, 3, 4, 5, 6, 7};
    return lane < static_cast<int32_t>(eight.count) ? all : Lanes{};
  }

  /// What is to become the change of position of a vertex so far back from this row; take(row) takes the
  /// vertices of eight places.
  template <class Take>
  STRANDCAST_LANES Lanes now(size_t axis, uint32_t back, Take take) const {
    return to_floats(wrapping_differences(take(now_[axis][back]), take(last_[axis][back])));
  }

  template <bool are_pieces>
  STRANDCAST_LANES void add_eight(const SampleEight& eight, MotionFit& fit) const {
    const Lanes trusted = trust<are_pieces>(eight);
    for (uint32_t lane = 0; lane < eight.count; ++lane)
      for (size_t axis = 0; axis < 3; ++axis) fit.count(trusted[lane]);
    const auto own = [&](const auto* row) STRANDCAST_LANES_LAMBDA { return eight.take<are_pieces>(row); };
    add_features(trusted, fit, eight, own);
    add_head(own, trusted, fit);
    LaneVectors wanted;
    for (size_t axis = 0; axis < 3; ++axis) wanted.axis[axis] = now(axis, 0, own);
    put(kMotionFeatureCount, wanted, trusted, fit);
    fit.add_eights(3);
  }

  /// What takes the vertices of eight places' nearest (0) or second neighbours.
  STRANDCAST_LANES auto neighbours_of(const SampleEight& eight, size_t which) const {
    std::array<uint32_t, kLaneCount> place;
    for (uint32_t lane = 0; lane < kLaneCount; ++lane)
      place[lane] = layout_.neighbour[which][eight.place[lane]];
    return [place](const auto* row) STRANDCAST_LANES_LAMBDA { return gather_lanes(row, place.data()); };
  }
  /// Loops, as one body a feature would cost the compiler a minute and gain nothing.
  template <class Own>
  STRANDCAST_LANES void add_features(const Lanes& trusted, MotionFit& fit, const SampleEight& eight,
                                     Own own) const {
    add_features_of<MotionStrand::Own>(own, trusted, fit);
    add_features_of<MotionStrand::Neighbour>(neighbours_of(eight, 0), trusted, fit);
    add_features_of<MotionStrand::SecondNeighbour>(neighbours_of(eight, 1), trusted, fit);
  }
  template <MotionStrand strand, class Take>
  STRANDCAST_LANES void add_features_of(Take take, const Lanes& trusted, MotionFit& fit) const {
    constexpr uint32_t kFirst = first_feature_of(strand), kEnd = kFirst + feature_count_of(strand);
    for (uint32_t k = kFirst; k < kEnd; ++k) {
      const MotionFeature& feature = kMotionFeatures[k];
      LaneVectors value;
      for (size_t axis = 0; axis < 3; ++axis)
        value.axis[axis] = feature.quantity == MotionQuantity::Now
                               ? now(axis, static_cast<uint32_t>(-feature.tipward), take)
                               : take(rows_[axis][k]);
      put(k, value, trusted, fit);
    }
  }

  template <class Own>
  STRANDCAST_LANES void add_head(Own own, const Lanes& trusted, MotionFit& fit) const {
    WideDoubles last[3];
    for (size_t axis = 0; axis < 3; ++axis)
      last[axis] = __builtin_convertvector(own(last_[axis][0]), WideDoubles);
    for (uint32_t k = 0; k < kHeadStepCount; ++k) {
      LaneVectors value;
      for (size_t axis = 0; axis < 3; ++axis) {
        const auto& step = frame_.head.step[k].row[axis];
        WideDoubles change = WideDoubles{} + step[3];
        for (size_t i = 0; i < 3; ++i) change += step[i] * last[i];
        value.axis[axis] = __builtin_convertvector(change, Lanes);
      }
      put(kHeadFeature + k, value, trusted, fit);
    }
  }

  /// Samples are the axes of one place after the other.
  STRANDCAST_LANES static void put(uint32_t k, const LaneVectors& value, const Lanes& trusted,
                                   MotionFit& fit) {
    const Lanes x = trusted * value.axis[0];
    const Lanes y = trusted * value.axis[1];
    const Lanes z = trusted * value.axis[2];
    const Lanes xy_0 = __builtin_shufflevector(x, y, 0, 8, 0, 1, 9, 0, 2, 10);
    const Lanes xy_1 = __builtin_shufflevector(x, y, 0, 3, 11, 0, 4, 12, 0, 5);
    const Lanes xy_2 = __builtin_shufflevector(x, y, 13, 0, 6, 14, 0, 7, 15, 0);
    fit.room(0)[k] = __builtin_shufflevector(xy_0, z, 0, 1, 8, 3, 4, 9, 6, 7);
    fit.room(1)[k] = __builtin_shufflevector(xy_1, z, 10, 1, 2, 11, 4, 5, 12, 7);
    fit.room(2)[k] = __builtin_shufflevector(xy_2, z, 0, 13, 2, 3, 14, 5, 6, 15);
  }

  const Layout& layout_;
  const Frame& frame_;
  std::array<FeatureRows, 3> rows_;
  std::array<std::array<const int32_t*, kNowRows>, 3> now_;   // positions wanted
  std::array<std::array<const int32_t*, kNowRows>, 3> last_;  // positions in the last frame
  std::array<const float*, 3> residual_;
  std::array<const float*, 3> child_residual_;
};

struct MotionSamples {
  const Layout& layout;
  const History& history;
  const Planes<int32_t>& target;
  std::span<const SampleEight> sample;
  Frame& frame;
};

struct ClassSamples {
  const MotionSamples& of;
  uint32_t motion_class;
  MotionFit& fit;
};

STRANDCAST_LANES void add_class_lanes(const ClassSamples& samples) {
  const MotionSamples& of = samples.of;
  for (uint32_t v = 0; v < of.layout.vertex_count; ++v)
    if (motion_class(of.layout, v) == samples.motion_class)
      SampleRow(of.layout, of.history, of.target, of.frame, v).add(of.sample, samples.fit);
}
STRANDCAST_KERNEL(add_class, ClassSamples);

/// Share of the last decoded length that predicts the next one best, in 1/16.
STRANDCAST_LANES void fit_length_blend_lanes(const MotionSamples& of) {
  const size_t stride = of.layout.stride;
  const double quantum_m = static_cast<double>(of.history.quantum_m);
  double numerator = 0.0;
  double denominator = 0.0;
  const auto length = [](const Planes<int32_t>& planes, size_t row, size_t parent,
                         const std::array<uint32_t, kLaneCount>& place) STRANDCAST_LANES_LAMBDA {
    WideDoubles squares{};
    for (const auto& plane : planes) {
      const WideDoubles edge =
          __builtin_convertvector(gather_lanes(plane.data() + row, place.data()), WideDoubles) -
          __builtin_convertvector(gather_lanes(plane.data() + parent, place.data()), WideDoubles);
      squares += edge * edge;
    }
    WideDoubles root;
    for (uint32_t lane = 0; lane < kLaneCount; ++lane) root[lane] = __builtin_sqrt(squares[lane]);
    return root;
  };
  for (uint32_t v = 1; v < of.layout.vertex_count; ++v) {
    for (const SampleEight& eight : of.sample) {
      const WideDoubles now = length(of.target, v * stride, (v - 1) * stride, eight.place);
      const WideDoubles then = length(of.history.lattice, v * stride, (v - 1) * stride, eight.place);
      const WideDoubles rest =
          __builtin_convertvector(
              gather_lanes(of.layout.rest_length_m.data() + v * stride, eight.place.data()), WideDoubles) /
          quantum_m;
      const WideDoubles product = (now - rest) * (then - rest);
      const WideDoubles square = (then - rest) * (then - rest);
      for (uint32_t lane = 0; lane < eight.count; ++lane) {
        numerator += product[lane];
        denominator += square[lane];
      }
    }
  }
  const double share = denominator > 0.0 ? std::clamp(numerator / denominator, 0.0, 1.0) : 0.0;
  of.frame.length_blend = static_cast<uint8_t>(std::lrint(share / kLengthWeight));
}
STRANDCAST_KERNEL(fit_length_blend, MotionSamples);

}  // namespace

void fit_motion(simd::InstructionSet set, const Layout& layout, const History& history,
                const Planes<int32_t>& target, WorkerPool& workers, Frame& frame) {
  const std::vector<uint32_t> places = sample_places(layout);
  std::vector<SampleEight> sample;
  for (size_t i = 0; i < places.size(); i += kLaneCount) sample.emplace_back(layout, places, i);
  const MotionSamples samples{layout, history, target, sample, frame};
  const uint32_t class_count = motion_class_count(layout);
  for_each_part(encode_terms(layout, workers), class_count + 1, [&](uint32_t part) {
    if (part == class_count) return fit_length_blend(set, samples);
    MotionFit fit;
    add_class(set, {samples, part, fit});
    frame.weights[part] = fit.weights(kMotionWeight, feature_noise());
  });
  frame.apply_weights();
}

}  // namespace strandcast::tangent
