#include "common/strands/strand_predictor.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include "common/base/check.h"
#include "common/simd/raw_lanes.h"
#include "common/strands/least_squares.h"
#include "common/strands/morton.h"
#include "common/strands/strand_rows.h"

namespace strandcast {

RowFeatures row_features(const StrandChain& chain, const int32_t* now, const int32_t* zeros, size_t axis,
                         uint32_t vertex_index) {
  const size_t stride = chain.strand_count;
  const size_t begin = axis * chain.plane_size() + vertex_index * stride;
  const int32_t* velocity = chain.velocity.data() + begin;
  const int32_t* residual = chain.residual.data() + begin;
  const bool has_parent = vertex_index >= 1;
  const bool has_grandparent = vertex_index >= 2;
  const bool has_child = vertex_index + 1 < chain.vertex_count;
  RowFeatures features;
  features.now = now + begin;
  features.then = velocity;
  features.residual_then = residual;
  features.row = {velocity,
                  residual,
                  has_parent ? features.now - stride : zeros,
                  has_parent ? velocity - stride : zeros,
                  has_parent ? residual - stride : zeros,
                  has_grandparent ? features.now - 2 * stride : zeros,
                  has_grandparent ? velocity - 2 * stride : zeros,
                  has_child ? velocity + stride : zeros,
                  has_child ? residual + stride : zeros};
  return features;
}

namespace {

STRANDCAST_LANES void sum_rows_lanes(const RowSums& of) {
  const auto f = of.features.row;
  std::array<uint32_t, kRowFeatureCount> w;
  for (uint32_t k = 0; k < kRowFeatureCount; ++k) w[k] = static_cast<uint32_t>(int32_t{of.weights[k]});
  const auto add_block = [&](size_t s, auto load, auto store) STRANDCAST_LANES_LAMBDA {
    auto block = load(f[0] + s) * w[0] + kPredictionRound;
    for (uint32_t k = 1; k < kRowFeatureCount; ++k) block += load(f[k] + s) * w[k];
    store(block, of.sum + s);
  };
  size_t s = 0;
  for (; s + simd::kLanes <= of.count; s += simd::kLanes)
    add_block(
        s,
        [](const int32_t* from)
            STRANDCAST_LANES_LAMBDA { return (simd::UintBits)simd::raw::load_lanes(from); },
        [](const simd::UintBits& block, uint32_t* to)
            STRANDCAST_LANES_LAMBDA { std::memcpy(to, &block, sizeof block); });
  for (; s < of.count; ++s)
    add_block(
        s, [](const int32_t* from) STRANDCAST_LANES_LAMBDA { return static_cast<uint32_t>(*from); },
        [](uint32_t one, uint32_t* to) STRANDCAST_LANES_LAMBDA { *to = one; });
}

}  // namespace

STRANDCAST_KERNEL(sum_rows, RowSums);

namespace {

constexpr uint32_t kOwnThen = 0;  // feature

/// Calls visit(row begin, features, weights) for each row, root rows first.
template <class Visit>
void for_each_row(const StrandChain& chain, const PredictorWeights& weights, const int32_t* now,
                  Visit visit) {
  const std::vector<int32_t> zeros(chain.strand_count, 0);
  for (size_t axis = 0; axis < 3; ++axis) {
    for (uint32_t vertex_index = 0; vertex_index < chain.vertex_count; ++vertex_index) {
      const size_t begin = axis * chain.plane_size() + static_cast<size_t>(vertex_index) * chain.strand_count;
      visit(begin, row_features(chain, now, zeros.data(), axis, vertex_index),
            weights[row_class(vertex_index, chain.vertex_count)]);
    }
  }
}

// ---- neighbours ----

double root_distance(const StrandChain& chain, uint32_t a, uint32_t b) {
  double sum = 0.0;
  for (size_t axis = 0; axis < 3; ++axis) {
    const int32_t* root = chain.lattice.data() + axis * chain.plane_size();
    const double difference = static_cast<double>(root[a]) - root[b];
    sum += difference * difference;
  }
  return sum;
}

/// For each strand of `order`, in which neighbours lie close together, the two nearest of smaller index.
void find_neighbours(StrandChain& chain, const std::vector<uint32_t>& order) {
  constexpr size_t kWindow = 24;  // places on the curve searched to each side
  chain.neighbour.resize(chain.strand_count);
  chain.second_neighbour.resize(chain.strand_count);
  for (size_t place = 0; place < order.size(); ++place) {
    const uint32_t s = order[place];
    std::array<double, 2> best = {INFINITY, INFINITY};
    std::array<uint32_t, 2> found = {s, s};
    const size_t begin = place > kWindow ? place - kWindow : 0;
    const size_t end = std::min(order.size(), place + kWindow + 1);
    for (size_t i = begin; i < end; ++i) {
      const uint32_t candidate = order[i];
      if (candidate >= s) continue;
      const double distance = root_distance(chain, s, candidate);
      if (distance < best[0]) {
        best = {distance, best[0]};
        found = {candidate, found[0]};
      } else if (distance < best[1]) {
        best[1] = distance;
        found[1] = candidate;
      }
    }
    chain.neighbour[s] = found[0];
    chain.second_neighbour[s] = found[1];
  }
}

/// The strands in the order of a Morton curve through their roots.
std::vector<uint32_t> root_curve_order(const StrandChain& chain) {
  const size_t plane = chain.plane_size();
  std::array<int64_t, 3> low;
  int64_t extent = 1;
  for (size_t axis = 0; axis < 3; ++axis) {
    const auto [min, max] = std::minmax_element(
        chain.lattice.begin() + static_cast<std::ptrdiff_t>(axis * plane),
        chain.lattice.begin() + static_cast<std::ptrdiff_t>(axis * plane) + chain.strand_count);
    low[axis] = *min;
    extent = std::max(extent, int64_t{*max} - *min + 1);
  }
  std::vector<uint32_t> code(chain.strand_count);
  for (size_t s = 0; s < code.size(); ++s) {
    for (size_t axis = 0; axis < 3; ++axis) {
      const auto cell = static_cast<uint32_t>((chain.lattice[axis * plane + s] - low[axis]) * 1024 / extent);
      code[s] |= morton_bits(cell) << axis;
    }
  }
  std::vector<uint32_t> order(chain.strand_count);
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) { return code[a] < code[b]; });
  return order;
}

// ---- least squares ----

constexpr uint32_t kTerms = kFeatureCount + 1;  // the velocity itself last
constexpr uint32_t kSampleStrands = 192;
constexpr uint32_t kLanes = 8;
using VelocityGram = Gram<kFeatureCount>;
constexpr double kGramFloor = 1e-3;

/// Feature values of the sampled strands of one row, term by term, padded with zeros to whole lanes.
struct Sample {
  std::vector<uint32_t> strand;
  size_t stride = 0;
  std::vector<float> value;  // (kTerms x stride)

  explicit Sample(uint32_t strand_count) {
    const uint32_t step = std::max(1u, strand_count / kSampleStrands);
    for (uint32_t s = step / 2; s < strand_count; s += step) strand.push_back(s);
    stride = (strand.size() + kLanes - 1) / kLanes * kLanes;
    value.assign(kTerms * stride, 0.0f);
  }
  void load(const StrandChain& chain, const RowFeatures& features) {
    for (size_t i = 0; i < strand.size(); ++i) {
      const uint32_t s = strand[i];
      float* at = value.data() + i;
      for (uint32_t k = 0; k < kRowFeatureCount; ++k) at[k * stride] = static_cast<float>(features.row[k][s]);
      uint32_t k = kRowFeatureCount;
      for (const uint32_t n : {chain.neighbour[s], chain.second_neighbour[s]}) {
        const bool has_neighbour = n != s;
        at[k++ * stride] = has_neighbour ? static_cast<float>(features.now[n]) : 0.0f;
        at[k++ * stride] = has_neighbour ? static_cast<float>(features.then[n]) : 0.0f;
        at[k++ * stride] = has_neighbour ? static_cast<float>(features.residual_then[n]) : 0.0f;
      }
      at[k * stride] = static_cast<float>(features.now[s]);
    }
  }
  void add_to(VelocityGram& gram) const {
    for (uint32_t a = 0; a < kTerms; ++a) {
      for (uint32_t b = a; b < kTerms; ++b) {
        const float* x = value.data() + a * stride;
        const float* y = value.data() + b * stride;
        std::array<float, kLanes> sum{};
        for (size_t i = 0; i < stride; i += kLanes)
          for (uint32_t lane = 0; lane < kLanes; ++lane) sum[lane] += x[i + lane] * y[i + lane];
        for (const float part : sum) gram[a][b] += part;
      }
    }
  }
  /// Sum of log2(1 + |error|) over the row: close to the bits it will take.
  double cost(const RowWeights& weights) const {
    double bits = 0.0;
    for (size_t i = 0; i < strand.size(); ++i) {
      float predicted = 0.0f;
      for (uint32_t k = 0; k < kFeatureCount; ++k)
        predicted += static_cast<float>(weights[k]) * value[k * stride + i];
      const float error = value[kFeatureCount * stride + i] - predicted * (1.0f / (1 << kWeightShift));
      bits += std::log2(1.0f + std::abs(error));
    }
    return bits;
  }
};

}  // namespace

void find_neighbours(StrandChain& chain) {
  find_neighbours(chain, root_curve_order(chain));
}

PredictorWeights fit_weights(const StrandChain& chain, const std::vector<int32_t>& velocity) {
  std::array<VelocityGram, kRowClassCount> gram{};
  Sample sample(chain.strand_count);
  const PredictorWeights still{};
  for_each_row(
      chain, still, velocity.data(), [&](size_t begin, const RowFeatures& features, const RowWeights&) {
        const auto vertex_index = static_cast<uint32_t>(begin % chain.plane_size() / chain.strand_count);
        sample.load(chain, features);
        sample.add_to(gram[row_class(vertex_index, chain.vertex_count)]);
      });

  PredictorWeights fitted;
  PredictorWeights steady{};
  for (uint32_t c = 0; c < kRowClassCount; ++c) {
    fitted[c] = solve_weights<kFeatureCount>(gram[c], kGramFloor, 1.0 / (1 << kWeightShift));
    steady[c][kOwnThen] = 1 << kWeightShift;
  }
  std::array<std::array<double, kRowClassCount>, 3> bits{};
  for_each_row(
      chain, still, velocity.data(), [&](size_t begin, const RowFeatures& features, const RowWeights&) {
        const auto vertex_index = static_cast<uint32_t>(begin % chain.plane_size() / chain.strand_count);
        const uint32_t c = row_class(vertex_index, chain.vertex_count);
        if (vertex_index % 4 != 2 && vertex_index + 1 != chain.vertex_count) return;  // enough to judge by
        sample.load(chain, features);
        bits[0][c] += sample.cost(fitted[c]);
        bits[1][c] += sample.cost(steady[c]);
        bits[2][c] += sample.cost(still[c]);
      });
  PredictorWeights best = fitted;
  for (uint32_t c = 0; c < kRowClassCount; ++c) {
    if (bits[1][c] < bits[0][c]) best[c] = steady[c];
    if (bits[2][c] <= std::min(bits[0][c], bits[1][c])) best[c] = still[c];
  }
  return best;
}

namespace {

/// work(i, prediction) for every value of (3 x vertex_count x strand_count), in the order of decoding:
/// `velocity` is known for all before.
template <class Work>
void for_each_prediction(const StrandChain& chain, const PredictorWeights& weights, const int32_t* velocity,
                         Work work) {
  std::vector<uint32_t> sum(chain.strand_count);
  const simd::InstructionSet set = simd::widest_set();
  for_each_row(chain, weights, velocity,
               [&](size_t begin, const RowFeatures& features, const RowWeights& row_weights) {
                 sum_rows(set, {features, row_weights, sum.data(), sum.size()});
                 const NeighbourTerms neighbours(row_weights);
                 for (size_t s = 0; s < sum.size(); ++s)
                   work(begin + s, neighbours.predict(chain, features, sum[s], s));
               });
}

}  // namespace

std::vector<int32_t> find_residual(const StrandChain& chain, const PredictorWeights& weights,
                                   const std::vector<int32_t>& velocity) {
  CHECK(velocity.size() == 3 * chain.plane_size());
  std::vector<int32_t> residual(velocity.size());
  for_each_prediction(chain, weights, velocity.data(), [&](size_t i, int32_t prediction) {
    residual[i] = wrapping_difference(velocity[i], prediction);
  });
  return residual;
}

std::vector<int32_t> find_velocity(const StrandChain& chain, const PredictorWeights& weights,
                                   const std::vector<int32_t>& residual) {
  CHECK(residual.size() == 3 * chain.plane_size());
  std::vector<int32_t> velocity(residual.size());
  for_each_prediction(chain, weights, velocity.data(), [&](size_t i, int32_t prediction) {
    velocity[i] = wrapping_sum(residual[i], prediction);
  });
  return velocity;
}

}  // namespace strandcast
