#include "common/strands/asset/strands.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "common/base/check.h"
#include "common/strands/asset/numbers.h"
#include "common/strands/byte_io.h"
#include "common/strands/least_squares.h"
#include "common/strands/morton.h"
#include "common/strands/wrapping.h"

namespace strandcast::asset {
namespace {

constexpr uint32_t kOwn = 3;          // segments of the strand itself before the one that is expected
constexpr uint32_t kOfNeighbour = 3;  // segments of a neighbour, from the one beside on
constexpr uint32_t kNeighbours = 2;
constexpr uint32_t kFeatureCount = kOwn + kNeighbours * kOfNeighbour;
constexpr uint32_t kClassCount = 8;  // of vertices that share weights: the first few, then all others
constexpr int kWeightBits = 12;
constexpr uint32_t kNoStrand = ~0u;
constexpr uint32_t kCells = 1024;  // of the Morton curve, along each axis

using Weights = std::array<std::array<int16_t, kFeatureCount>, kClassCount>;
using Neighbours = std::array<uint32_t, kNeighbours>;
/// Segments from which one is expected; zeros where there are none.
using Features = std::array<glm::ivec3, kFeatureCount>;

uint32_t class_of(uint32_t vertex) {
  return std::min(vertex, kClassCount) - 1;
}

/// How the last coordinate of a segment is expected.
enum class LastAxis : uint8_t { ByWeights, ByLength };

/// The box around the roots.
struct RootBox {
  glm::ivec3 low{0};
  std::array<uint8_t, 3> bits{};  // of a coordinate, from the low corner on

  static RootBox around(const StrandShape& shape) {
    RootBox box{shape.points.point.front()};
    glm::ivec3 high = box.low;
    for (size_t strand = 0; strand < shape.strand_count; ++strand) {
      box.low = glm::min(box.low, shape.points.point[strand * shape.vertex_count]);
      high = glm::max(high, shape.points.point[strand * shape.vertex_count]);
    }
    for (int axis = 0; axis < 3; ++axis)
      box.bits[axis] =
          static_cast<uint8_t>(std::bit_width(static_cast<uint32_t>(high[axis] - box.low[axis])));
    return box;
  }
  /// Whether every root in the box is in range.
  bool is_inside() const {
    const auto is_axis_inside = [&](int axis) {
      return bits[axis] < 32 && low[axis] > -2 * kMaxStep &&
             low[axis] + (int64_t{1} << bits[axis]) <= 2 * kMaxStep;
    };
    return is_axis_inside(0) && is_axis_inside(1) && is_axis_inside(2);
  }
};

int64_t squared_distance(const glm::ivec3& a, const glm::ivec3& b) {
  int64_t sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const int64_t away = int64_t{a[axis]} - b[axis];
    sum += away * away;
  }
  return sum;
}

/// Strands along a Morton curve through their roots.
std::vector<uint32_t> curve_order(const StrandShape& shape, const RootBox& box) {
  const int longest = *std::max_element(box.bits.begin(), box.bits.end());
  const int shift = std::max(longest - std::countr_zero(kCells), 0);
  std::vector<uint32_t> code(shape.strand_count);
  for (size_t strand = 0; strand < shape.strand_count; ++strand)
    for (int axis = 0; axis < 3; ++axis) {
      const int32_t along = shape.points.point[strand * shape.vertex_count][axis] - box.low[axis];
      code[strand] |= morton_bits(static_cast<uint32_t>(along >> shift)) << axis;
    }
  std::vector<uint32_t> order(shape.strand_count);
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) { return code[a] < code[b]; });
  return order;
}

/// Of every strand the earlier ones with the nearest roots among a few on either side along the curve, from
/// which later strands have been taken out.
std::vector<Neighbours> find_neighbours(const StrandShape& shape, const RootBox& box) {
  constexpr int kSeen = 4;  // on either side
  const std::vector<uint32_t> order = curve_order(shape, box);
  std::vector<uint32_t> before(shape.strand_count, kNoStrand), after(shape.strand_count, kNoStrand);
  for (size_t i = 1; i < order.size(); ++i) {
    before[order[i]] = order[i - 1];
    after[order[i - 1]] = order[i];
  }
  const auto root = [&](uint32_t strand) -> const glm::ivec3& {
    return shape.points.point[size_t{strand} * shape.vertex_count];
  };
  std::vector<Neighbours> nearest(shape.strand_count, {kNoStrand, kNoStrand});
  for (uint32_t strand = shape.strand_count; strand-- > 0;) {
    std::array<int64_t, kNeighbours> distance;
    distance.fill(INT64_MAX);
    for (const auto* next : {&before, &after}) {
      uint32_t other = (*next)[strand];
      for (int seen = 0; seen < kSeen && other != kNoStrand; ++seen, other = (*next)[other]) {
        const int64_t away = squared_distance(root(strand), root(other));
        if (away < distance[0]) {
          distance = {away, distance[0]};
          nearest[strand] = {other, nearest[strand][0]};
        } else if (away < distance[1]) {
          distance[1] = away;
          nearest[strand][1] = other;
        }
      }
    }
    if (before[strand] != kNoStrand) after[before[strand]] = after[strand];
    if (after[strand] != kNoStrand) before[after[strand]] = before[strand];
  }
  return nearest;
}

/// What is expected of the segment to a vertex, from those that are known by then.
class Expectation {
 public:
  /// `shape` and `neighbours` outlive this object.
  Expectation(const StrandShape& shape, const std::vector<Neighbours>& neighbours)
      : vertex_count_(shape.vertex_count),
        point_(shape.points.point),
        neighbours_(neighbours),
        size_(shape.points.point.size(), 0) {}

  Features features(uint32_t strand, uint32_t vertex) const {
    Features features{};
    const size_t at = size_t{strand} * vertex_count_ + vertex;
    for (uint32_t k = 0; k < std::min(kOwn, vertex - 1); ++k) features[k] = segment(at - 1 - k);
    for (uint32_t n = 0; n < kNeighbours; ++n) {
      const uint32_t other = neighbours_[strand][n];
      if (other == kNoStrand) continue;
      const size_t beside = size_t{other} * vertex_count_ + vertex;
      for (uint32_t k = 0; k < std::min(kOfNeighbour, vertex); ++k)
        features[kOwn + n * kOfNeighbour + k] = segment(beside - k);
    }
    return features;
  }
  /// Returns about how far the first two coordinates are from what is expected.
  uint32_t expected_size(uint32_t strand, uint32_t vertex) const {
    const size_t at = size_t{strand} * vertex_count_ + vertex;
    uint32_t sum = 0, count = 0;
    if (vertex > 1) {
      sum += 2 * size_[at - 1];
      count += 2;
    }
    for (const uint32_t other : neighbours_[strand]) {
      if (other == kNoStrand) continue;
      sum += size_[size_t{other} * vertex_count_ + vertex];
      ++count;
    }
    return count > 0 ? sum / count : 0;
  }
  void set_size(uint32_t strand, uint32_t vertex, uint32_t size) {
    size_[size_t{strand} * vertex_count_ + vertex] = size;
  }

 private:
  glm::ivec3 segment(size_t at) const { return point_[at] - point_[at - 1]; }

  uint32_t vertex_count_;
  const std::vector<glm::ivec3>& point_;
  const std::vector<Neighbours>& neighbours_;
  std::vector<uint32_t> size_;  // of what was not expected
};

glm::ivec3 weighted(const Features& features, const std::array<int16_t, kFeatureCount>& weights) {
  glm::ivec3 result;
  for (int axis = 0; axis < 3; ++axis) {
    int64_t sum = 1 << (kWeightBits - 1);
    for (uint32_t k = 0; k < kFeatureCount; ++k) sum += int64_t{features[k][axis]} * weights[k];
    result[axis] = static_cast<int32_t>(std::clamp<int64_t>(sum >> kWeightBits, -kMaxStep, kMaxStep));
  }
  return result;
}

/// Fits the weights to some of the strands.
Weights fit_weights(const StrandShape& shape, const std::vector<Neighbours>& neighbours) {
  constexpr uint32_t kSamples = 1'000;  // strands, at most
  constexpr double kNoise = 1.0;        // steps: rounding
  const Expectation known(shape, neighbours);
  std::array<double, kFeatureCount> noise;
  noise.fill(kNoise);
  Weights weights{};
  const uint32_t every = shape.strand_count / kSamples + 1;
  for (uint32_t c = 0; c < std::min(kClassCount, shape.vertex_count - 1); ++c) {
    LeastSquares<kFeatureCount> fit;
    const uint32_t last = c + 1 < kClassCount ? c + 2 : shape.vertex_count;
    for (uint32_t strand = 0; strand < shape.strand_count; strand += every)
      for (uint32_t v = c + 1; v < last; ++v) {
        const Features features = known.features(strand, v);
        const glm::ivec3* const point = &shape.points.point[size_t{strand} * shape.vertex_count + v];
        for (int axis = 0; axis < 3; ++axis) {
          std::array<float, kFeatureCount> sample;
          for (uint32_t k = 0; k < kFeatureCount; ++k) sample[k] = static_cast<float>(features[k][axis]);
          fit.add(sample, static_cast<float>(point[0][axis] - point[-1][axis]), 1.0f);
        }
      }
    fit.flush();
    weights[c] = fit.weights(1.0 / (1 << kWeightBits), noise);
  }
  return weights;
}

/// Returns the last coordinate of a segment of this squared length, on the side of `expected`.
int32_t at_length(int32_t expected, double first, double second, double squared_length) {
  const double rest = squared_length - first * first - second * second;
  if (!(rest > 0.0)) return expected;
  const auto along = static_cast<int32_t>(std::min(std::floor(std::sqrt(rest) + 0.5), double{kMaxStep}));
  return expected < 0 ? -along : along;
}

/// Writes or reads the strands behind their roots.
template <class Coder>
class StrandCoding {
 public:
  StrandCoding(Coder& coder, LastAxis last_axis, const Weights& weights,
               const std::vector<Neighbours>& neighbours, StrandShape& shape)
      : coder_(coder),
        last_axis_(last_axis),
        weights_(weights),
        shape_(shape),
        expectation_(shape, neighbours) {}

  /// Returns false where a coordinate is out of range.
  bool code() {
    for (uint32_t strand = 0; strand < shape_.strand_count && !coder_.is_short() && is_inside_; ++strand) {
      squares_ = 0.0;
      off_length_ = 0;
      for (uint32_t vertex = 1; vertex < shape_.vertex_count; ++vertex) code_segment(strand, vertex);
    }
    return is_inside_;
  }

 private:
  static constexpr uint32_t kFirstKind = 0, kSecondKind = 1, kThirdKind = 2;

  void code_segment(uint32_t strand, uint32_t vertex) {
    point_ = shape_.points.point.data() + size_t{strand} * shape_.vertex_count + vertex;
    glm::ivec3 expected = weighted(expectation_.features(strand, vertex), weights_[class_of(vertex)]);
    int last = 0;
    for (int axis = 1; axis < 3; ++axis)
      if (std::abs(expected[axis]) > std::abs(expected[last])) last = axis;
    const int first = (last + 1) % 3, second = (last + 2) % 3;
    const uint32_t size = expectation_.expected_size(strand, vertex);
    const uint32_t off = code_axis(first, expected[first], kFirstKind, size) +
                         code_axis(second, expected[second], kSecondKind, size);
    expectation_.set_size(strand, vertex, off / 2);
    if (last_axis_ == LastAxis::ByLength && vertex > 1) {
      expected[last] = at_length(expected[last], segment(first), segment(second), squares_ / (vertex - 1));
      off_length_ = (off_length_ + code_axis(last, expected[last], kThirdKind, off_length_) + 1) / 2;
    } else {
      code_axis(last, expected[last], kSecondKind, size);
    }
    for (int axis = 0; axis < 3; ++axis) squares_ += segment(axis) * segment(axis);
  }
  /// Returns how far a coordinate is from where it was expected.
  uint32_t code_axis(int axis, int32_t expected, uint32_t kind, uint32_t size) {
    int32_t left = 0;
    if constexpr (!Coder::kReads) left = point_[0][axis] - point_[-1][axis] - expected;
    coder_.code(left, kind, size);
    if constexpr (Coder::kReads) {
      const int32_t at = wrapping_sum(point_[-1][axis], wrapping_sum(expected, left));
      is_inside_ &= at > -kMaxStep && at < kMaxStep;
      point_[0][axis] = is_inside_ ? at : 0;
    }
    return magnitude(left);
  }
  double segment(int axis) const { return static_cast<double>(point_[0][axis] - point_[-1][axis]); }

  Coder& coder_;
  LastAxis last_axis_;
  const Weights& weights_;
  StrandShape& shape_;
  Expectation expectation_;
  glm::ivec3* point_ = nullptr;
  double squares_ = 0.0;     // of the lengths of this strand's segments so far
  uint32_t off_length_ = 0;  // how far its last coordinates were from where their lengths put them
  bool is_inside_ = true;
};

template <class Coder>
void code_roots(Coder& coder, const RootBox& box, StrandShape& shape) {
  for (size_t strand = 0; strand < shape.strand_count; ++strand)
    for (int axis = 0; axis < 3; ++axis) {
      int32_t& coordinate = shape.points.point[strand * shape.vertex_count][axis];
      auto along = static_cast<uint32_t>(coordinate - box.low[axis]);
      coder.code_bits(along, box.bits[axis]);
      coordinate = wrapping_sum(box.low[axis], static_cast<int32_t>(along));
    }
}

}  // namespace

void append_strands(const StrandShape& shape, std::vector<std::byte>& destination) {
  const RootBox box = RootBox::around(shape);
  const std::vector<Neighbours> neighbours = find_neighbours(shape, box);
  const Weights weights = fit_weights(shape, neighbours);
  std::array<std::vector<std::byte>, 2> coded;
  StrandShape same = shape;
  for (const LastAxis last_axis : {LastAxis::ByWeights, LastAxis::ByLength}) {
    NumberWriter numbers;
    code_roots(numbers, box, same);
    CHECK(StrandCoding(numbers, last_axis, weights, neighbours, same).code());
    numbers.finish(coded[static_cast<size_t>(last_axis)]);
  }
  const bool is_by_length = coded[1].size() < coded[0].size();
  ByteWriter writer(destination);
  writer.put(static_cast<uint8_t>(shape.points.step_bits));
  writer.put(static_cast<uint8_t>(is_by_length));
  for (int axis = 0; axis < 3; ++axis) writer.put(box.low[axis]);
  for (const uint8_t bits : box.bits) writer.put(bits);
  writer.put_bytes(std::as_bytes(std::span(weights)));
  writer.put_bytes(coded[is_by_length ? 1 : 0]);
}

Status read_strands(std::span<const std::byte> source, StrandShape& shape) {
  ByteReader reader(source);
  shape.points.step_bits = reader.take<uint8_t>();
  const auto last_axis = static_cast<LastAxis>(reader.take<uint8_t>());
  RootBox box;
  for (int axis = 0; axis < 3; ++axis) box.low[axis] = reader.take<int32_t>();
  for (uint8_t& bits : box.bits) bits = reader.take<uint8_t>();
  Weights weights{};
  for (auto& of_class : weights)
    for (int16_t& weight : of_class) weight = reader.take<int16_t>();
  if (!reader.ok() || !box.is_inside() || shape.points.step_bits > kMaxStepBits ||
      last_axis > LastAxis::ByLength)
    return make_error(ErrorCode::BadInput, "the asset's strands begin with numbers that are out of range");
  ValueReader values;
  ASSIGN_OR_RETURN(const auto rest, values.open(reader.rest()));
  shape.points.point.assign(size_t{shape.strand_count} * shape.vertex_count, glm::ivec3(0));
  NumberReader numbers(values);
  code_roots(numbers, box, shape);
  const std::vector<Neighbours> neighbours = find_neighbours(shape, box);
  if (!StrandCoding(numbers, last_axis, weights, neighbours, shape).code())
    return make_error(ErrorCode::BadInput, "a rest position of the asset is out of range");
  if (!values.is_spent() || !rest.empty())
    return make_error(ErrorCode::BadInput, "the asset's strands are not as long as their bytes");
  return {};
}

}  // namespace strandcast::asset
