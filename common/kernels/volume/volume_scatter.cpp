#include "common/kernels/volume/volume_scatter.h"

#include <cstring>

namespace strandcast {
namespace {

using simd::Bool;
using simd::Float;
using simd::FloatBits;
using simd::IntBits;
using simd::kLanes;
using simd::vec3;
using Doubles = double __attribute__((vector_size(64)));  // two neighbouring nodes
using HalfDoubles = double __attribute__((vector_size(32)));
using Quad = float __attribute__((vector_size(16)));

static_assert(kBlockStrands % kLanes == 0 && kLanes == 8 && sizeof(VolumeRecord) == sizeof(FloatBits));

STRANDCAST_LANES vec3 load_vertex(const StrandBlocksView& blocks, uint32_t block, uint32_t vertex,
                                  uint32_t lane) {
  const float* const row = blocks.row(block, vertex, 0) + lane;
  return {simd::load_lanes(row), simd::load_lanes(row + kBlockStrands),
          simd::load_lanes(row + 2 * kBlockStrands)};
}

struct Sample {
  vec3 cells;  // in the lattice
  vec3 velocity_mps;
};

STRANDCAST_LANES Sample load_sample(const VolumeScatter& work, uint32_t block, uint32_t vertex,
                                    uint32_t lane) {
  Sample sample;
  vec3 point = load_vertex(work.position_m, block, vertex, lane);
  sample.velocity_mps = vec3(Float(0.0f));
  if (work.velocity_mps.values != nullptr) {
    const vec3 head = {work.head_velocity_mps.x, work.head_velocity_mps.y, work.head_velocity_mps.z};
    const vec3 velocity = load_vertex(work.velocity_mps, block, vertex, lane);
    sample.velocity_mps = velocity * Float(work.velocity_scale) - head;
    point = point + sample.velocity_mps * Float(work.ahead_s);
  }
  const glm::mat3& m = work.cells_from_world;
  sample.cells = {(m[2].x * point.z + m[1].x * point.y) + m[0].x * point.x,
                  (m[2].y * point.z + m[1].y * point.y) + m[0].y * point.x,
                  (m[2].z * point.z + m[1].z * point.y) + m[0].z * point.x};
  return sample;
}

STRANDCAST_LANES vec3 between(const vec3& a, const vec3& b, float share) {
  return {simd::mix(a.x, b.x, share), simd::mix(a.y, b.y, share), simd::mix(a.z, b.z, share)};
}

/// The layer that a sample is in, from 0; -1 where it is too far away along some axis, no number, or no hair.
STRANDCAST_LANES IntBits layer_of(const Sample& sample, const Float& below, const Float& length) {
  const Float reach = kVolumeReachCells;
  const Bool is_near = length > 0.0f && simd::abs(sample.cells.x) < reach &&
                       simd::abs(sample.cells.y) < reach && simd::abs(sample.cells.z) < reach;
  const Float layer = simd::select(is_near, below + static_cast<float>(kMaxLayers / 2), Float(-1.0f));
  return simd::to_integers(layer);
}

/// visit(sample, layer in each lane, length in each lane, lanes in use) for all samples of a range.
template <class Visit>
STRANDCAST_LANES void for_each_sample(const VolumeScatterRange& range, Visit visit) {
  const VolumeScatter& work = *range.work;
  const uint32_t strand_count = work.position_m.strand_count;
  const uint32_t vertex_count = work.position_m.row_count;
  for (uint32_t block = range.begin; block < range.end; ++block)
    for (uint32_t lane = 0; lane < kBlockStrands; lane += kLanes) {
      const uint32_t strand = block * kBlockStrands + lane;
      if (strand >= strand_count) break;
      const uint32_t used = strand_count - strand < kLanes ? strand_count - strand : kLanes;
      Sample before = load_sample(work, block, 0, lane);
      for (uint32_t vertex = 0; vertex < vertex_count; ++vertex) {
        const Sample now = vertex == 0 ? before : load_sample(work, block, vertex, lane);
        const float* const length =
            work.length_m + (size_t{block} * vertex_count + vertex) * kBlockStrands + lane;
        if (work.samples == 1) {
          visit(now, length, used);
        } else if (vertex > 0) {
          const float share = 1.0f / static_cast<float>(work.samples);
          for (uint32_t i = 0; i < work.samples; ++i) {
            const float at = (static_cast<float>(i) + 0.5f) * share;
            visit({between(before.cells, now.cells, at), between(before.velocity_mps, now.velocity_mps, at)},
                  length, used);
          }
        }
        before = now;
      }
    }
}

STRANDCAST_LANES void widen(const Float& x, const Bool& which, Float& low, Float& high) {
  low = simd::select(which && x < low, x, low);
  high = simd::select(which && x > high, x, high);
}

STRANDCAST_LANES void count_records_lanes(const VolumeScatterRange& range) {
  const VolumeScatter& work = *range.work;
  constexpr float kFar = static_cast<float>(kMaxLayers);
  vec3 low = vec3(Float(kFar));
  vec3 high = vec3(Float(-kFar));
  const Float number = simd::lane_numbers();
  for_each_sample(range,
                  [&](const Sample& sample, const float* length, uint32_t used) STRANDCAST_LANES_LAMBDA {
                    const Float below = simd::floor(sample.cells.z);
                    const IntBits layer = layer_of(sample, below, simd::load_lanes(length));
                    const Bool is_there = number < static_cast<float>(used) &&
                                          simd::Float(__builtin_convertvector(layer, FloatBits)) >= 0.0f;
                    widen(sample.cells.x, is_there, low.x, high.x);
                    widen(sample.cells.y, is_there, low.y, high.y);
                    widen(sample.cells.z, is_there, low.z, high.z);
                    int32_t layers[kLanes];
                    std::memcpy(layers, &layer, sizeof layers);
                    for (uint32_t i = 0; i < used; ++i)
                      if (layers[i] >= 0) ++work.counts[layers[i]];
                  });
  for (size_t axis = 0; axis < 3; ++axis) {
    float lows[kLanes];
    float highs[kLanes];
    simd::store_lanes(low[static_cast<uint32_t>(axis)], lows);
    simd::store_lanes(high[static_cast<uint32_t>(axis)], highs);
    for (uint32_t i = 0; i < kLanes; ++i) {
      if (lows[i] < work.bounds->low[axis]) work.bounds->low[axis] = lows[i];
      if (highs[i] > work.bounds->high[axis]) work.bounds->high[axis] = highs[i];
    }
  }
}

/// Numbers of eight lanes become lanes of eight numbers.
STRANDCAST_LANES void turn_over(FloatBits (&rows)[8]) {
  FloatBits pairs[8];
  for (uint32_t i = 0; i < 8; i += 2) {
    pairs[i] = __builtin_shufflevector(rows[i], rows[i + 1], 0, 8, 1, 9, 4, 12, 5, 13);
    pairs[i + 1] = __builtin_shufflevector(rows[i], rows[i + 1], 2, 10, 3, 11, 6, 14, 7, 15);
  }
  FloatBits fours[8];
  for (uint32_t i = 0; i < 8; i += 4)
    for (uint32_t k = 0; k < 2; ++k) {
      const FloatBits a = pairs[i + k];
      const FloatBits b = pairs[i + 2 + k];
      fours[i + 2 * k] = __builtin_shufflevector(a, b, 0, 1, 8, 9, 4, 5, 12, 13);
      fours[i + 2 * k + 1] = __builtin_shufflevector(a, b, 2, 3, 10, 11, 6, 7, 14, 15);
    }
  for (uint32_t i = 0; i < 4; ++i) {
    rows[i] = __builtin_shufflevector(fours[i], fours[i + 4], 0, 1, 2, 3, 8, 9, 10, 11);
    rows[i + 4] = __builtin_shufflevector(fours[i], fours[i + 4], 4, 5, 6, 7, 12, 13, 14, 15);
  }
}

STRANDCAST_LANES void place_records_lanes(const VolumeScatterRange& range) {
  const VolumeScatter& work = *range.work;
  const Float share = 1.0f / static_cast<float>(work.samples);
  const vec3 first = {static_cast<float>(work.first.x), static_cast<float>(work.first.y),
                      static_cast<float>(work.first.z)};
  for_each_sample(
      range, [&](const Sample& sample, const float* length, uint32_t used) STRANDCAST_LANES_LAMBDA {
        const IntBits layer = layer_of(sample, simd::floor(sample.cells.z), simd::load_lanes(length));
        FloatBits of_lane[kLanes] = {(sample.cells.x - first.x).v, (sample.cells.y - first.y).v,
                                     (sample.cells.z - first.z).v, (simd::load_lanes(length) * share).v,
                                     sample.velocity_mps.x.v,      sample.velocity_mps.y.v,
                                     sample.velocity_mps.z.v,      FloatBits{}};
        turn_over(of_lane);
        int32_t layers[kLanes];
        std::memcpy(layers, &layer, sizeof layers);
        for (uint32_t i = 0; i < used; ++i)
          if (layers[i] >= 0)
            std::memcpy(work.records + work.places[layers[i]]++, of_lane + i, sizeof(VolumeRecord));
      });
}

STRANDCAST_LANES void add_to(double* node, const Doubles& value, double weight) {
  Doubles sum;
  std::memcpy(&sum, node, sizeof sum);
  sum += value * weight;
  std::memcpy(node, &sum, sizeof sum);
}

/// A finished layer of nodes out of the scratch, which is zero again.
STRANDCAST_LANES void store_layer(const VolumeSlab& slab, double* layer, uint8_t* is_used, glm::vec4* sums,
                                  uint8_t* rows) {
  for (uint32_t y = 0; y < slab.nodes.y; ++y) {
    rows[y] = is_used[y];
    if (is_used[y] == 0) continue;
    is_used[y] = 0;
    double* const row = layer + size_t{y} * slab.nodes.x * 4;
    glm::vec4* const to = sums + size_t{y} * slab.nodes.x;
    for (uint32_t x = 0; x < slab.nodes.x; ++x) {
      HalfDoubles sum;
      std::memcpy(&sum, row + size_t{x} * 4, sizeof sum);
      const Quad rounded = __builtin_convertvector(sum, Quad);
      std::memcpy(to + x, &rounded, sizeof rounded);
    }
    std::memset(row, 0, size_t{slab.nodes.x} * 4 * sizeof(double));
  }
}

// Records are taken in turns from so many places of a layer.
constexpr uint32_t kRecordStreams = 4;

STRANDCAST_LANES void sum_slab_lanes(const VolumeSlab& slab) {
  const size_t layer_size = size_t{slab.nodes.x} * slab.nodes.y;
  uint64_t outside = 0;
  for (uint32_t layer = slab.begin; layer < slab.end; ++layer) {
    // The layer of nodes in front of these cells, and the one behind them.
    double* const front = slab.scratch + (layer % 2) * layer_size * 4;
    double* const back = slab.scratch + ((layer + 1) % 2) * layer_size * 4;
    uint8_t* const front_rows = slab.scratch_rows + (layer % 2) * slab.nodes.y;
    uint8_t* const back_rows = slab.scratch_rows + ((layer + 1) % 2) * slab.nodes.y;
    // Neighbours lie in the same cell, whose sum would wait for the one before.
    const uint32_t begin = slab.layer_begin[layer];
    const uint32_t count = slab.layer_begin[layer + 1] - begin;
    const uint32_t apart = (count + kRecordStreams - 1) / kRecordStreams;
    for (uint32_t k = 0; k < apart * kRecordStreams; ++k) {
      const uint32_t i = k % kRecordStreams * apart + k / kRecordStreams;
      if (i >= count) continue;
      const VolumeRecord& record = slab.records[begin + i];
      const auto x = static_cast<int32_t>(record.at[0]);
      const auto y = static_cast<int32_t>(record.at[1]);
      if (!(record.at[0] >= 0.0f && record.at[1] >= 0.0f) || x + 1 >= static_cast<int32_t>(slab.nodes.x) ||
          y + 1 >= static_cast<int32_t>(slab.nodes.y)) {
        ++outside;
        continue;
      }
      const double along_x = static_cast<double>(record.at[0]) - x;
      const double along_y = static_cast<double>(record.at[1]) - y;
      const double along_z = static_cast<double>(record.at[2]) - layer;
      const double length = record.length_m;
      const double far = along_x * length;
      const double near = length - far;
      const Doubles value = {
          near * record.velocity_mps[0], near * record.velocity_mps[1], near * record.velocity_mps[2], near,
          far * record.velocity_mps[0],  far * record.velocity_mps[1],  far * record.velocity_mps[2],  far};
      const size_t at = (static_cast<size_t>(y) * slab.nodes.x + static_cast<size_t>(x)) * 4;
      const size_t above = at + size_t{slab.nodes.x} * 4;
      add_to(front + at, value, (1.0 - along_y) * (1.0 - along_z));
      add_to(front + above, value, along_y * (1.0 - along_z));
      add_to(back + at, value, (1.0 - along_y) * along_z);
      add_to(back + above, value, along_y * along_z);
      front_rows[y] = front_rows[y + 1] = back_rows[y] = back_rows[y + 1] = 1;
    }
    store_layer(slab, front, front_rows, slab.sums + layer * layer_size,
                slab.rows + size_t{layer} * slab.nodes.y);
  }
  store_layer(slab, slab.scratch + (slab.end % 2) * layer_size * 4,
              slab.scratch_rows + (slab.end % 2) * slab.nodes.y, slab.last_sums, slab.last_rows);
  *slab.outside = outside;
}

}  // namespace

STRANDCAST_KERNEL(count_records, VolumeScatterRange);
STRANDCAST_KERNEL(place_records, VolumeScatterRange);
STRANDCAST_KERNEL(sum_slab, VolumeSlab);

}  // namespace strandcast
