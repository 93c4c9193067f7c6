#include "common/codec/tangent_motion.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "common/codec/least_squares.h"
#include "common/codec/wide.h"
#include "common/codec/wrapping.h"

namespace strandcast {
namespace {

// Features of a vertex, each a vector; weights are the same for all axes. "then" is the last frame, "before"
// the one before that; the parent is the vertex nearer to the root.
//   0 velocity then            1 residual then        2 velocity before      3 residual before
//   4 parent's velocity now    5 parent's then        6 parent's residual    7 parent's residual before
//   8 grandparent's now        9 grandparent's then  10 child's velocity    11 child's residual
//  12 child's velocity before 13 child's residual before
//  14 neighbour's now         15 neighbour's then    16 neighbour's residual
//  17 second neighbour's now  18 then                19 residual
constexpr uint32_t kRowFeatureCount = 14;

// The cell of a coded vertex: tangent steps of 1.22 bounds and length steps of 0.8 keep its farthest point
// within the bound, with room for rounding: sqrt(1 - 1.22^2 / 2) = 0.51 >= 0.8 / 2.
constexpr float kTangentStep = 1.22f * kStepsPerBound;
constexpr float kLengthStep = 0.8f * kStepsPerBound;
// What is left of the bound when positions were rounded to the lattice (sqrt(3) / 2) and to floats before.
constexpr int64_t kReach = kStepsPerBound - 3;
constexpr int32_t kEscapeStep = 292;  // 2 kReach / sqrt(3)

constexpr float kTinySquared = 1e-12f;
constexpr float kLargest = 4e6f;         // of an edge, in steps; rounding by adding needs it
constexpr float kRounder = 12582912.0f;  // 1.5 * 2^23: floats there are whole numbers

using Lanes = std::array<float, kBlockSize>;
using IntLanes = std::array<int32_t, kBlockSize>;

/// Nearest whole number, ties to even, limited to +-kLargest; -kLargest for NaN.
inline int32_t nearest(float value) {
  const float low = value > -kLargest ? value : -kLargest;
  const float within = low < kLargest ? low : kLargest;
  return static_cast<int32_t>((within + kRounder) - kRounder);
}

/// Which weights serve a row. Near the root and at the tip strands move by laws of their own.
uint32_t motion_class(const TangentLayout& layout, uint32_t v) {
  if (v < 2) return 0;
  if (v + 1 == layout.vertex_count) return 1;
  if (motion_class_count(layout) == kFewMotionClasses) return 2;
  if (v + 2 == layout.vertex_count) return 3;
  if (v < 5) return v + 2;
  return 2 * v < layout.vertex_count ? 2 : 7;
}

/// One row of one axis: feature rows, of which absent ones point to zeros.
struct FeatureRow {
  std::array<const float*, kRowFeatureCount> row;
  const float* now;
  const float* then;
  const float* residual;
};

FeatureRow feature_row(const TangentLayout& layout, const TangentHistory& history,
                       const std::vector<float>& velocity_now, size_t axis, uint32_t v, const float* zeros) {
  const size_t stride = layout.stride;
  const size_t begin = v * stride;
  const float* now = velocity_now.data() + begin;
  const float* then = history.velocity[axis].data() + begin;
  const float* before = history.velocity_before[axis].data() + begin;
  const float* residual = history.residual[axis].data() + begin;
  const float* residual_before = history.residual_before[axis].data() + begin;
  const bool has_parent = v >= 1;
  const bool has_grandparent = v >= 2;
  const bool has_child = v + 1 < layout.vertex_count;
  FeatureRow features;
  features.now = now;
  features.then = then;
  features.residual = residual;
  features.row = {then,
                  residual,
                  before,
                  residual_before,
                  has_parent ? now - stride : zeros,
                  has_parent ? then - stride : zeros,
                  has_parent ? residual - stride : zeros,
                  has_parent ? residual_before - stride : zeros,
                  has_grandparent ? now - 2 * stride : zeros,
                  has_grandparent ? then - 2 * stride : zeros,
                  has_child ? then + stride : zeros,
                  has_child ? residual + stride : zeros,
                  has_child ? before + stride : zeros,
                  has_child ? residual_before + stride : zeros};
  return features;
}

using FloatWeights = std::array<float, kMotionFeatureCount>;

/// sum += weighted features of the block at `place`.
inline void add_features(const FeatureRow& features, const FloatWeights& w, const TangentLayout& layout,
                         size_t place, Lanes& sum) {
  for (uint32_t k = 0; k < kRowFeatureCount; ++k) {
    const float* row = features.row[k] + place;
    for (uint32_t lane = 0; lane < kBlockSize; ++lane) sum[lane] += w[k] * row[lane];
  }
  for (uint32_t which = 0; which < 2; ++which) {
    const uint32_t* neighbour = layout.neighbour[which].data() + place;
    const float* weight = w.data() + kRowFeatureCount + 3 * which;
    Lanes now;
    Lanes then;
    Lanes residual;
    for (uint32_t lane = 0; lane < kBlockSize; ++lane) {
      now[lane] = features.now[neighbour[lane]];
      then[lane] = features.then[neighbour[lane]];
      residual[lane] = features.residual[neighbour[lane]];
    }
    for (uint32_t lane = 0; lane < kBlockSize; ++lane)
      sum[lane] += (weight[0] * now[lane] + weight[1] * then[lane]) + weight[2] * residual[lane];
  }
}

/// Where the vertices of a block are expected: `length` along `along` from `base`, and two directions across.
struct Expected {
  std::array<IntLanes, 3> base;
  std::array<Lanes, 3> along;
  std::array<Lanes, 3> first;
  std::array<Lanes, 3> second;
  Lanes length;
};

inline void find_frames(Expected& expected) {
  auto& [x, y, z] = expected.along;
  for (uint32_t lane = 0; lane < kBlockSize; ++lane) {
    // An orthonormal basis without branches (Duff et al. 2017, Building an Orthonormal Basis, Revisited).
    const float sign = z[lane] >= 0.0f ? 1.0f : -1.0f;
    const float a = -1.0f / (sign + z[lane]);
    const float b = x[lane] * y[lane] * a;
    expected.first[0][lane] = 1.0f + sign * (x[lane] * x[lane] * a);
    expected.first[1][lane] = sign * b;
    expected.first[2][lane] = -sign * x[lane];
    expected.second[0][lane] = b;
    expected.second[1][lane] = sign + y[lane] * y[lane] * a;
    expected.second[2][lane] = -y[lane];
  }
}

/// Positions, limited to where rounding holds, from the expectation and the integers of one lane.
inline std::array<int32_t, 3> placed(const Expected& expected, uint32_t lane, int32_t first, int32_t second,
                                     int32_t length) {
  const float across = static_cast<float>(first) * kTangentStep;
  const float also = static_cast<float>(second) * kTangentStep;
  std::array<float, 3> edge;
  for (size_t axis = 0; axis < 3; ++axis)
    edge[axis] = (expected.along[axis][lane] * expected.length[lane] + expected.first[axis][lane] * across) +
                 expected.second[axis][lane] * also;
  const float squared = (edge[0] * edge[0] + edge[1] * edge[1]) + edge[2] * edge[2];
  const float wanted = expected.length[lane] + static_cast<float>(length) * kLengthStep;
  const float scale = squared > kTinySquared ? wanted / std::sqrt(squared) : 0.0f;
  std::array<int32_t, 3> position;
  for (size_t axis = 0; axis < 3; ++axis)
    position[axis] = wrapping_sum(expected.base[axis][lane], nearest(edge[axis] * scale));
  return position;
}

/// Everything about one row that its blocks share.
struct Row {
  const TangentLayout& layout;
  const TangentHistory& history;
  TangentFrame& frame;
  uint32_t v;
  FloatWeights weights;
  float length_blend;
  std::array<FeatureRow, 3> features;

  Row(const TangentLayout& layout_, const TangentHistory& history_, TangentFrame& frame_, uint32_t v_,
      const float* zeros)
      : layout(layout_), history(history_), frame(frame_), v(v_) {
    const auto& given = frame.weights[motion_class(layout, v)];
    for (uint32_t k = 0; k < kMotionFeatureCount; ++k)
      weights[k] = static_cast<float>(given[k]) * kMotionWeight;
    length_blend = static_cast<float>(frame.length_blend) * kLengthWeight;
    for (size_t axis = 0; axis < 3; ++axis)
      features[axis] = feature_row(layout, history, frame.velocity[axis], axis, v, zeros);
  }

  size_t at(size_t place) const { return v * static_cast<size_t>(layout.stride) + place; }

  void known_length(size_t place, Expected& expected) const {
    const float* rest = layout.rest_length_m.data() + at(place);
    for (uint32_t lane = 0; lane < kBlockSize; ++lane) expected.length[lane] = rest[lane] / history.quantum_m;
    if (frame.length_blend == 0) return;
    Lanes squared{};
    for (size_t axis = 0; axis < 3; ++axis) {
      const int32_t* own = history.lattice[axis].data() + at(place);
      const int32_t* parent = own - layout.stride;
      for (uint32_t lane = 0; lane < kBlockSize; ++lane) {
        const auto edge = static_cast<float>(wrapping_difference(own[lane], parent[lane]));
        squared[lane] += edge * edge;
      }
    }
    for (uint32_t lane = 0; lane < kBlockSize; ++lane)
      expected.length[lane] += length_blend * (std::sqrt(squared[lane]) - expected.length[lane]);
  }

  inline void expect(size_t place, Expected& expected) const {
    std::array<Lanes, 3> edge;
    Lanes squared{};
    for (size_t axis = 0; axis < 3; ++axis) {
      const int32_t* last = history.lattice[axis].data() + at(place);
      IntLanes& base = expected.base[axis];
      if (v == 0)
        base.fill(0);
      else
        std::memcpy(base.data(), frame.lattice[axis].data() + at(place) - layout.stride, sizeof(base));
      for (uint32_t lane = 0; lane < kBlockSize; ++lane)
        edge[axis][lane] = static_cast<float>(wrapping_difference(last[lane], base[lane]));
      add_features(features[axis], weights, layout, place, edge[axis]);
      for (uint32_t lane = 0; lane < kBlockSize; ++lane) squared[lane] += edge[axis][lane] * edge[axis][lane];
    }
    Lanes scale;
    for (uint32_t lane = 0; lane < kBlockSize; ++lane) {
      const float length = std::sqrt(squared[lane]);
      if (v == 0) expected.length[lane] = length;
      scale[lane] = squared[lane] > kTinySquared ? 1.0f / length : 0.0f;
    }
    if (v != 0) known_length(place, expected);
    for (size_t axis = 0; axis < 3; ++axis) {
      const float instead = axis == 1 ? 1.0f : 0.0f;  // where there is no direction
      for (uint32_t lane = 0; lane < kBlockSize; ++lane)
        expected.along[axis][lane] = scale[lane] != 0.0f ? edge[axis][lane] * scale[lane] : instead;
    }
    find_frames(expected);
  }

  /// Stores a position and what follows from it.
  inline void store(const Expected& expected, size_t place, const std::array<IntLanes, 3>& position) const {
    for (size_t axis = 0; axis < 3; ++axis) {
      const int32_t* last = history.lattice[axis].data() + at(place);
      int32_t* lattice = frame.lattice[axis].data() + at(place);
      float* velocity = frame.velocity[axis].data() + at(place);
      float* residual = frame.residual[axis].data() + at(place);
      for (uint32_t lane = 0; lane < kBlockSize; ++lane) {
        lattice[lane] = position[axis][lane];
        velocity[lane] = static_cast<float>(wrapping_difference(position[axis][lane], last[lane]));
        residual[lane] =
            static_cast<float>(wrapping_difference(position[axis][lane], expected.base[axis][lane])) -
            expected.along[axis][lane] * expected.length[lane];
      }
    }
  }

  std::array<int32_t, 3> escaped(const Escape& escape) const {
    std::array<int32_t, 3> position;
    for (size_t axis = 0; axis < 3; ++axis) {
      const uint32_t moved = static_cast<uint32_t>(escape.step[axis]) * uint32_t{kEscapeStep};
      position[axis] = wrapping_sum(history.lattice[axis][escape.at], static_cast<int32_t>(moved));
    }
    return position;
  }
};

// ---- encoder ----

int64_t squared_distance(const std::array<int32_t, 3>& a, const std::array<int32_t, 3>& b) {
  int64_t sum = 0;
  for (size_t axis = 0; axis < 3; ++axis) {
    const int64_t difference = int64_t{a[axis]} - b[axis];
    if (difference > kStepsPerBound || difference < -kStepsPerBound) return INT64_MAX;
    sum += difference * difference;
  }
  return sum;
}

struct Code {
  int32_t first = 0;
  int32_t second = 0;
  int32_t length = 0;
};

/// The cheapest integers that put the vertex of a lane within reach of `target`; nothing when none do.
/// Cheap are small ones: a dead zone as wide as the bound allows.
bool find_code(const Expected& expected, uint32_t lane, const std::array<int32_t, 3>& target, Code& code,
               std::array<int32_t, 3>& position) {
  std::array<float, 3> edge;
  for (size_t axis = 0; axis < 3; ++axis)
    edge[axis] = static_cast<float>(wrapping_difference(target[axis], expected.base[axis][lane]));
  const auto dot = [&edge, lane](const std::array<Lanes, 3>& d) {
    return (edge[0] * d[0][lane] + edge[1] * d[1][lane]) + edge[2] * d[2][lane];
  };
  const float along = dot(expected.along);
  const float length = std::sqrt((edge[0] * edge[0] + edge[1] * edge[1]) + edge[2] * edge[2]);
  const float beyond = (length - expected.length[lane]) / kLengthStep;
  // Seen from the vertex before, coordinates where the direction to the target meets the tangent plane.
  constexpr float kSteepest = 0.2f;
  float scale = 0.0f;
  if (length > 0.0f) {
    if (!(along > kSteepest * length)) return false;
    scale = expected.length[lane] / along / kTangentStep;
  }
  const float a = dot(expected.first) * scale;
  const float b = dot(expected.second) * scale;
  constexpr float kFarthest = 1e5f;
  if (!(std::abs(a) < kFarthest && std::abs(b) < kFarthest && std::abs(beyond) < kFarthest)) return false;

  // Towards zero first: the corner of the cell nearest to the expectation, then its sides, then opposite.
  const int32_t low_a = static_cast<int32_t>(a);
  const int32_t low_b = static_cast<int32_t>(b);
  const int32_t high_a = low_a + (a < 0.0f ? -1 : 1);
  const int32_t high_b = low_b + (b < 0.0f ? -1 : 1);
  const bool is_a_farther = std::abs(a - static_cast<float>(low_a)) > std::abs(b - static_cast<float>(low_b));
  const std::array<std::array<int32_t, 2>, 4> corners = {
      {{low_a, low_b},
       {is_a_farther ? high_a : low_a, is_a_farther ? low_b : high_b},
       {is_a_farther ? low_a : high_a, is_a_farther ? high_b : low_b},
       {high_a, high_b}}};
  const int32_t rounded = nearest(beyond);
  for (const int32_t correction : {0, rounded}) {
    if (correction == 0 && std::abs(beyond) > 1.3f) continue;
    for (const auto& [first, second] : corners) {
      position = placed(expected, lane, first, second, correction);
      if (squared_distance(position, target) > kReach * kReach) continue;
      code = {first, second, correction};
      return true;
    }
    if (rounded == 0) break;
  }
  return false;
}

Escape make_escape(const TangentHistory& history, size_t at, const std::array<int32_t, 3>& target) {
  Escape escape;
  escape.at = at;
  for (size_t axis = 0; axis < 3; ++axis) {
    const int64_t way = int64_t{target[axis]} - history.lattice[axis][at];
    const int64_t half = way < 0 ? -kEscapeStep / 2 : kEscapeStep / 2;
    escape.step[axis] = static_cast<int32_t>((way + half) / kEscapeStep);
  }
  return escape;
}

void quantise_block(const Row& row, const Expected& expected, const Planes<int32_t>& target, size_t place,
                    std::vector<Escape>& escapes) {
  TangentFrame& frame = row.frame;
  std::array<IntLanes, 3> position;
  for (uint32_t lane = 0; lane < kBlockSize; ++lane) {
    const size_t at = row.at(place) + lane;
    const std::array<int32_t, 3> wanted = {target[0][at], target[1][at], target[2][at]};
    Code code;
    std::array<int32_t, 3> reached;
    if (!find_code(expected, lane, wanted, code, reached)) {
      code = {0, 0, kEscapedLength};
      escapes.push_back(make_escape(row.history, at, wanted));
      reached = row.escaped(escapes.back());
    }
    frame.first[at] = code.first;
    frame.second[at] = code.second;
    frame.length[at] = code.length;
    for (size_t axis = 0; axis < 3; ++axis) position[axis][lane] = reached[axis];
  }
  row.store(expected, place, position);
}

constexpr uint32_t kSampleStrands = 384;
constexpr double kNoise = 8.0;  // steps; a thirtieth of the bound is not worth predicting

/// Share of the last decoded length that predicts the next one best, in 1/16.
uint8_t fit_length_blend(const TangentLayout& layout, const TangentHistory& history,
                         const Planes<int32_t>& target, uint32_t step) {
  double numerator = 0.0;
  double denominator = 0.0;
  for (uint32_t v = 1; v < layout.vertex_count; ++v) {
    for (size_t place = step / 2; place < layout.no_neighbour(); place += step) {
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

void TangentHistory::reset(const TangentLayout& layout) {
  for (size_t axis = 0; axis < 3; ++axis) {
    lattice[axis].assign(layout.plane_size(), 0);
    for (auto* plane : {&velocity[axis], &velocity_before[axis], &residual[axis], &residual_before[axis]})
      plane->assign(layout.plane_size(), 0.0f);
  }
}

void TangentHistory::coarsen() {
  constexpr int32_t kHalf = 1 << (kCoarseLatticeShift - 1);
  for (size_t axis = 0; axis < 3; ++axis) {
    for (size_t i = 0; i < lattice[axis].size(); ++i) {
      const int32_t ahead = wrapping_sum(lattice[axis][i], nearest(velocity[axis][i]));
      const int32_t steps = wrapping_sum(ahead, kHalf) >> kCoarseLatticeShift;
      lattice[axis][i] = static_cast<int32_t>(static_cast<uint32_t>(steps) << kCoarseLatticeShift);
    }
    for (auto* plane : {&velocity[axis], &velocity_before[axis], &residual[axis], &residual_before[axis]})
      std::fill(plane->begin(), plane->end(), 0.0f);
  }
}

void TangentFrame::resize(const TangentLayout& layout) {
  const size_t size = layout.plane_size();
  // Zeros, as places without a strand must hold them also after a chain with another layout.
  for (auto* values : {&first, &second, &length}) values->assign(size, 0);
  for (size_t axis = 0; axis < 3; ++axis) {
    lattice[axis].assign(size, 0);
    velocity[axis].assign(size, 0.0f);
    residual[axis].assign(size, 0.0f);
  }
  escapes.assign(layout.slice_count(), {});
}

uint32_t motion_class_count(const TangentLayout& layout) {
  const size_t vertices = size_t{layout.strand_count} * layout.vertex_count;
  return vertices < kManyVertices ? kFewMotionClasses : kMotionClassCount;
}

void fit_motion(const TangentLayout& layout, const TangentHistory& history, const Planes<int32_t>& target,
                TangentFrame& frame) {
  const uint32_t step = std::max(1u, layout.stride / kSampleStrands);
  frame.length_blend = fit_length_blend(layout, history, target, step);
  const std::vector<float> zeros(layout.stride, 0.0f);
  Planes<float> velocity;
  for (size_t axis = 0; axis < 3; ++axis) {
    velocity[axis].resize(layout.plane_size());
    for (size_t i = 0; i < velocity[axis].size(); ++i)
      velocity[axis][i] = static_cast<float>(wrapping_difference(target[axis][i], history.lattice[axis][i]));
  }
  std::array<LeastSquares<kMotionFeatureCount>, kMotionClassCount> fits;
  for (uint32_t v = 0; v < layout.vertex_count; ++v) {
    auto& fit = fits[motion_class(layout, v)];
    for (size_t axis = 0; axis < 3; ++axis) {
      const FeatureRow features = feature_row(layout, history, velocity[axis], axis, v, zeros.data());
      for (size_t place = step / 2; place < layout.no_neighbour(); place += step) {
        std::array<float, kMotionFeatureCount> value;
        for (uint32_t k = 0; k < kRowFeatureCount; ++k) value[k] = features.row[k][place];
        uint32_t k = kRowFeatureCount;
        for (const auto& neighbour : layout.neighbour) {
          value[k++] = features.now[neighbour[place]];
          value[k++] = features.then[neighbour[place]];
          value[k++] = features.residual[neighbour[place]];
        }
        fit.add(value, features.now[place]);
      }
      fit.flush();
    }
  }
  for (uint32_t c = 0; c < kMotionClassCount; ++c) frame.weights[c] = fits[c].weights(kMotionWeight, kNoise);
}

STRANDCAST_WIDE
void quantise_slice(const TangentLayout& layout, const TangentHistory& history, const Planes<int32_t>& target,
                    uint32_t slice, TangentFrame& frame) {
  const std::vector<float> zeros(layout.stride, 0.0f);
  std::vector<Escape>& escapes = frame.escapes[slice];
  for (uint32_t v = 0; v < layout.vertex_count; ++v) {
    const Row row(layout, history, frame, v, zeros.data());
    for (size_t place = layout.slice_begin[slice]; place < layout.slice_begin[slice + 1];
         place += kBlockSize) {
      Expected expected;
      row.expect(place, expected);
      quantise_block(row, expected, target, place, escapes);
    }
  }
}

STRANDCAST_WIDE
void place_slice(const TangentLayout& layout, const TangentHistory& history, uint32_t slice,
                 TangentFrame& frame) {
  const std::vector<float> zeros(layout.stride, 0.0f);
  auto escape = frame.escapes[slice].begin();
  for (uint32_t v = 0; v < layout.vertex_count; ++v) {
    const Row row(layout, history, frame, v, zeros.data());
    for (size_t place = layout.slice_begin[slice]; place < layout.slice_begin[slice + 1];
         place += kBlockSize) {
      Expected expected;
      row.expect(place, expected);
      std::array<IntLanes, 3> position;
      const size_t at = row.at(place);
      for (uint32_t lane = 0; lane < kBlockSize; ++lane) {
        const auto point =
            placed(expected, lane, frame.first[at + lane], frame.second[at + lane], frame.length[at + lane]);
        for (size_t axis = 0; axis < 3; ++axis) position[axis][lane] = point[axis];
      }
      for (; escape != frame.escapes[slice].end() && escape->at < at + kBlockSize; ++escape) {
        const auto point = row.escaped(*escape);
        for (size_t axis = 0; axis < 3; ++axis) position[axis][escape->at - at] = point[axis];
      }
      row.store(expected, place, position);
    }
  }
}

void remember(TangentHistory& history, TangentFrame& frame) {
  std::swap(history.lattice, frame.lattice);
  std::swap(history.velocity_before, history.velocity);
  std::swap(history.velocity, frame.velocity);
  std::swap(history.residual_before, history.residual);
  std::swap(history.residual, frame.residual);
}

}  // namespace strandcast
