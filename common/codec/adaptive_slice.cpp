#include "common/codec/adaptive_slice.h"

#include "common/codec/strand_rows.h"

namespace strandcast {
namespace {

/// Which table to use and how many low bits to leave out of it, from a weighted sum of the sizes near by.
struct Size {
  uint32_t index;
  uint32_t shift;
};

constexpr uint32_t kFirstWidth = 4;  // sums below 2^3 share the first steps
constexpr uint32_t kShiftWidth = 9;  // sums of more bits are halved until they have as many

Size size_of(uint32_t sum) {
  auto width = static_cast<uint32_t>(std::bit_width(sum));
  if (width < kFirstWidth) return {0, 0};
  const uint32_t shift = width > kShiftWidth ? width - kShiftWidth : 0;
  sum >>= shift;
  width -= shift;
  const uint32_t quarter = (sum >> (width - 3)) & 3u;
  return {std::min(1 + 4 * (width - kFirstWidth) + quarter, kSizeCount - 1), shift};
}

/// Writes values that are known.
struct WritePort {
  ValueWriter& writer;
  int32_t code(int32_t& value, int32_t guess, bool is_mirrored, SymbolTable& table, uint32_t shift) {
    const int32_t error = wrapping_difference(value, guess);
    writer.put(fold_sign(is_mirrored ? wrapping_difference(0, error) : error), table, shift);
    return error;
  }
};

/// Reads values and stores them.
struct ReadPort {
  ValueReader& reader;
  int32_t code(int32_t& value, int32_t guess, bool is_mirrored, SymbolTable& table, uint32_t shift) {
    const int32_t folded = unfold_sign(reader.take(table, shift));
    const int32_t error = is_mirrored ? wrapping_difference(0, folded) : folded;
    value = wrapping_sum(guess, error);
    return error;
  }
};

/// Rows of magnitudes around a vertex index, one axis.
struct SizeRows {
  const uint16_t* own_then;
  const uint16_t* parent_now;
  const uint16_t* grandparent_now;
  const uint16_t* child_then;
  uint16_t* now;
};

SizeRows size_rows(const AdaptiveChain& chain, AdaptiveFrame& frame, const uint16_t* zeros, size_t axis,
                   uint32_t vertex_index) {
  const size_t stride = chain.motion.strand_count;
  const size_t begin = axis * chain.motion.plane_size() + vertex_index * stride;
  SizeRows rows;
  rows.now = frame.magnitude.data() + begin;
  rows.own_then = chain.magnitude.data() + begin;
  rows.parent_now = vertex_index >= 1 ? rows.now - stride : zeros;
  rows.grandparent_now = vertex_index >= 2 ? rows.now - 2 * stride : zeros;
  rows.child_then = vertex_index + 1 < chain.motion.vertex_count ? rows.own_then + stride : zeros;
  return rows;
}

void sum_sizes(const SizeRows& rows, size_t begin, uint16_t* sum, size_t count) {
  const uint16_t* const own = rows.own_then + begin;
  const uint16_t* const parent = rows.parent_now + begin;
  const uint16_t* const grandparent = rows.grandparent_now + begin;
  const uint16_t* const child = rows.child_then + begin;
  for (size_t s = 0; s < count; ++s)
    sum[s] = static_cast<uint16_t>(2 * own[s] + 2 * parent[s] + grandparent[s] + child[s]);
}

template <class Port>
void code_motion(const AdaptiveChain& chain, const PredictorWeights& weights, uint32_t slice,
                 AdaptiveFrame& frame, SymbolTables& tables, Port port) {
  const StrandChain& motion = chain.motion;
  const size_t begin = chain.slice_begin(slice);
  const size_t count = chain.slice_begin(slice + 1) - begin;
  const std::vector<int32_t> zeros(motion.strand_count, 0);
  const std::vector<uint16_t> zero_sizes(motion.strand_count, 0);
  std::array<std::vector<uint32_t>, 3> sum;
  std::array<std::vector<uint16_t>, 3> size_sum;
  for (size_t axis = 0; axis < 3; ++axis) {
    sum[axis].resize(count);
    size_sum[axis].resize(count);
  }
  for (uint32_t vertex_index = 0; vertex_index < motion.vertex_count; ++vertex_index) {
    const RowWeights& row_weights = weights[row_class(vertex_index, motion.vertex_count)];
    const NeighbourTerms neighbours(row_weights);
    std::array<RowFeatures, 3> features;
    std::array<SizeRows, 3> sizes;
    for (size_t axis = 0; axis < 3; ++axis) {
      features[axis] = row_features(motion, frame.velocity.data(), zeros.data(), axis, vertex_index);
      sum_rows(features[axis], row_weights, begin, sum[axis].data(), count);
      sizes[axis] = size_rows(chain, frame, zero_sizes.data(), axis, vertex_index);
      sum_sizes(sizes[axis], begin, size_sum[axis].data(), count);
    }
    for (size_t i = 0; i < count; ++i) {
      const size_t s = begin + i;
      const uint32_t n = motion.neighbour[s];
      const uint32_t m = motion.second_neighbour[s];
      std::array<uint32_t, 3> near;
      uint32_t all = 0;
      for (size_t axis = 0; axis < 3; ++axis) {
        near[axis] = size_sum[axis][i];
        if (n != s) near[axis] += 2u * sizes[axis].now[n];
        if (m != s) near[axis] += sizes[axis].now[m];
        all += near[axis];
      }
      for (size_t axis = 0; axis < 3; ++axis) {
        const Size size = size_of((all + 2 * near[axis]) >> 2);
        const auto value = static_cast<int32_t>(neighbours.add(motion, features[axis], sum[axis][i], s));
        const int32_t guess = value >> kWeightShift;
        const int32_t fraction = (value & ((1 << kWeightShift) - 1)) - kPredictionRound;  // of the prediction
        const bool is_mirrored = fraction < 0;
        const auto bin =
            static_cast<uint32_t>(std::min(is_mirrored ? -fraction : fraction, kPredictionRound - 1)) *
                kFractionCount >>
            (kWeightShift - 1);
        SymbolTable& table = tables[(axis * kSizeCount + size.index) * kFractionCount + bin];
        const size_t at =
            axis * motion.plane_size() + vertex_index * static_cast<size_t>(motion.strand_count) + s;
        const int32_t error = port.code(frame.velocity[at], guess, is_mirrored, table, size.shift);
        const int32_t residual =
            wrapping_difference(static_cast<int32_t>(static_cast<uint32_t>(error) << kResidualBits),
                                fraction >> (kWeightShift - kResidualBits));
        const uint16_t magnitude = residual_magnitude(residual);
        frame.residual[at] = residual;
        sizes[axis].now[s] = magnitude;
        all += 4u * magnitude;
      }
    }
  }
}

}  // namespace

SymbolTables make_first_tables() {
  // Shares fall by a quarter from symbol to symbol; a few hundred values later that is forgotten.
  std::array<int32_t, kSymbolCount> share;
  int32_t sum = 0;
  for (uint32_t k = 0; k < kSymbolCount; ++k) {
    share[k] = k == 0 ? kProbabilityOne / 4 : share[k - 1] * 3 / 4;
    sum += share[k];
  }
  SymbolTable table;
  int32_t start = 0;
  for (uint32_t k = 0; k < kSymbolCount; ++k) {
    table.start[k] = static_cast<int16_t>(start);
    start += share[k];
  }
  SymbolTables tables;
  tables.fill(table);
  return tables;
}

SymbolTables mean_tables(std::span<const SymbolTables> tables) {
  SymbolTables mean;
  for (size_t i = 0; i < kTableCount; ++i) {
    for (uint32_t k = 0; k < kSymbolCount; ++k) {
      int32_t sum = 0;
      for (const SymbolTables& one : tables) sum += one[i].start[k];
      mean[i].start[k] = static_cast<int16_t>(sum / static_cast<int32_t>(tables.size()));
    }
  }
  return mean;
}

AdaptiveChain without_history(const AdaptiveChain& chain) {
  AdaptiveChain still;
  still.motion.strand_count = chain.motion.strand_count;
  still.motion.vertex_count = chain.motion.vertex_count;
  still.motion.neighbour = chain.motion.neighbour;
  still.motion.second_neighbour = chain.motion.second_neighbour;
  still.motion.velocity.assign(3 * chain.motion.plane_size(), 0);
  still.motion.residual = still.motion.velocity;
  still.magnitude.assign(still.motion.velocity.size(), 0);
  still.slice_count = chain.slice_count;
  still.tables = make_first_tables();
  return still;
}

std::vector<int32_t> edges_of(const StrandChain& chain) {
  std::vector<int32_t> edge = chain.lattice;
  for (size_t axis = 0; axis < 3; ++axis) {
    for (size_t i = axis * chain.plane_size() + chain.strand_count; i < (axis + 1) * chain.plane_size(); ++i)
      edge[i] = wrapping_difference(chain.lattice[i], chain.lattice[i - chain.strand_count]);
  }
  return edge;
}

std::vector<int32_t> lattice_of(const StrandChain& chain, std::vector<int32_t> edge) {
  for (size_t axis = 0; axis < 3; ++axis) {
    for (size_t i = axis * chain.plane_size() + chain.strand_count; i < (axis + 1) * chain.plane_size(); ++i)
      edge[i] = wrapping_sum(edge[i], edge[i - chain.strand_count]);
  }
  return edge;
}

void AdaptiveFrame::resize(size_t value_count) {
  velocity.resize(value_count);
  residual.resize(value_count);
  magnitude.resize(value_count);
}

uint16_t residual_magnitude(int32_t residual) {
  const uint32_t bits = static_cast<uint32_t>(residual);
  return static_cast<uint16_t>(std::min(residual < 0 ? 0u - bits : bits, kMaxMagnitude));
}

void write_motion(const AdaptiveChain& chain, const PredictorWeights& weights, uint32_t slice,
                  AdaptiveFrame& frame, SymbolTables& tables, ValueWriter& writer) {
  code_motion(chain, weights, slice, frame, tables, WritePort{writer});
}

void read_motion(const AdaptiveChain& chain, const PredictorWeights& weights, uint32_t slice,
                 AdaptiveFrame& frame, SymbolTables& tables, ValueReader& reader) {
  code_motion(chain, weights, slice, frame, tables, ReadPort{reader});
}

}  // namespace strandcast
