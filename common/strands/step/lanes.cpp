#include "common/strands/step/lanes.h"

#include "common/strands/snapshot.h"
#include "common/strands/tangent/row.h"

namespace strandcast::step {
namespace {

using namespace simd::raw;
constexpr uint32_t kHalves = kBlockStrands / kLaneCount;

STRANDCAST_LANES LaneVectors turned_by(const Turn& turn, const LaneVectors& v) {
  LaneVectors result;
  for (size_t i = 0; i < 3; ++i)
    result.axis[i] = (turn[i][0] * v.axis[0] + turn[i][1] * v.axis[1]) + turn[i][2] * v.axis[2];
  return result;
}

STRANDCAST_LANES LaneVectors load_vector(const float* row) {
  return {load_lanes(row), load_lanes(row + kBlockStrands), load_lanes(row + 2 * kBlockStrands)};
}
STRANDCAST_LANES void add_vector(float* row, const LaneVectors& change, float scale) {
  for (size_t i = 0; i < 3; ++i) {
    float* at = row + i * kBlockStrands;
    store_lanes(load_lanes(at) + scale * change.axis[i], at);
  }
}

/// Nearest whole numbers within the lattice; an end of it for NaN.
STRANDCAST_LANES IntLanes on_lattice(const Lanes& value) {
  constexpr auto kFarthest = static_cast<float>(kMaxLattice / 2);
  const Lanes low = value > -kFarthest ? value : Lanes{} - kFarthest;
  const Lanes within = low < kFarthest ? low : Lanes{} + kFarthest;
  return to_integers(within + (within < 0.0f ? Lanes{} - 0.5f : Lanes{} + 0.5f));
}

STRANDCAST_LANES void expect_blocks_lanes(const ExpectWork& work) {
  const float per_step = 1.0f / work.quantum_m;
  for (uint32_t block = work.block_begin; block < work.block_end; ++block) {
    for (uint32_t half = 0; half < kHalves; ++half) {
      const size_t place = size_t{block} * kBlockStrands + half * kLaneCount;
      if (place >= work.layout.no_neighbour()) continue;
      const IntLanes is_there = load_lanes(work.layout.presence.data() + place) > 0.5f;
      for (uint32_t v = 0; v < work.layout.vertex_count; ++v) {
        const float* row = work.position_m.row(block, v, 0) + half * kLaneCount;
        const LaneVectors head = turned_by(work.head_from_world, load_vector(row));
        for (size_t axis = 0; axis < 3; ++axis) {
          const IntLanes nearest = on_lattice(head.axis[axis] * per_step);
          store_lanes(is_there ? nearest : IntLanes{},
                      work.lattice[axis].data() + v * size_t{work.layout.stride} + place);
        }
      }
    }
  }
}

/// `axis` after the smallest rotation that takes the unit vector a to the unit vector b.
STRANDCAST_LANES LaneVectors carried(const LaneVectors& axis, const LaneVectors& a, const LaneVectors& b) {
  constexpr float kLeastSum = 0.05f;  // of one and the cosine; beyond, it stays
  LaneVectors sum;
  for (size_t i = 0; i < 3; ++i) sum.axis[i] = a.axis[i] + b.axis[i];
  const Lanes one_and_cosine = 1.0f + dots(a, b);
  const Lanes along = dots(axis, sum) / one_and_cosine;
  const Lanes along_a = 2.0f * dots(axis, a);
  LaneVectors result;
  for (size_t i = 0; i < 3; ++i) {
    const Lanes value = (axis.axis[i] - along * sum.axis[i]) + along_a * b.axis[i];
    result.axis[i] = one_and_cosine > kLeastSum ? value : axis.axis[i];
  }
  return result;
}

/// Difference of two points; its direction where it has one.
STRANDCAST_LANES LaneVectors direction_of(const LaneVectors& from, const LaneVectors& to, IntLanes& has) {
  constexpr float kTiny = 1e-14f;  // m^2
  LaneVectors edge;
  for (size_t i = 0; i < 3; ++i) edge.axis[i] = to.axis[i] - from.axis[i];
  const Lanes squared = dots(edge, edge);
  has &= squared > kTiny;
  const Lanes scale = 1.0f / square_roots(squared > kTiny ? squared : Lanes{} + 1.0f);
  for (Lanes& axis : edge.axis) axis *= scale;
  return edge;
}

STRANDCAST_LANES void correct_half(const CorrectWork& work, uint32_t block, uint32_t half) {
  const size_t place = size_t{block} * kBlockStrands + half * kLaneCount;
  const uint32_t lane = half * kLaneCount;
  LaneVectors start_before{};
  LaneVectors start_after{};
  bool is_start_moved = false;
  for (uint32_t v = 0; v < work.layout.vertex_count; ++v) {
    LaneVectors apart;
    IntLanes is_apart{};
    for (size_t axis = 0; axis < 3; ++axis) {
      const size_t at = v * size_t{work.layout.stride} + place;
      const IntLanes steps = wrapping_differences(load_lanes(work.decoded[axis].data() + at),
                                                  load_lanes(work.expected[axis].data() + at));
      is_apart |= steps != 0;
      apart.axis[axis] = to_floats(steps) * work.quantum_m;
    }
    const bool is_moved = is_any(is_apart);
    float* position = work.position_m.row(block, v, 0) + lane;
    const bool has_axes = work.axis != nullptr;
    if (!is_moved && !is_start_moved && !has_axes) continue;
    const LaneVectors before = load_vector(position);
    LaneVectors after = before;
    if (is_moved) {
      const LaneVectors moved = turned_by(work.world_from_head, apart);
      add_vector(position, moved, 1.0f);
      after = load_vector(position);
      if (v >= work.free_begin && v < work.free_end) {
        add_vector(work.velocity_mps.row(block, v, 0) + lane, moved, work.per_second);
        if (work.way_m != nullptr) add_vector(work.way_m->row(block, v, 0) + lane, moved, 1.0f);
        if (work.velocity_change_mps != nullptr)
          add_vector(work.velocity_change_mps->row(block, v, 0) + lane, moved, work.per_second);
      }
    }
    if (has_axes && v >= 1 && (is_moved || is_start_moved)) {
      float* row = work.axis->row(block, v, 0) + lane;
      IntLanes has = IntLanes{} - 1;
      const LaneVectors a = direction_of(start_before, before, has);
      const LaneVectors b = direction_of(start_after, after, has);
      const LaneVectors axis = load_vector(row);
      const LaneVectors turned = carried(axis, a, b);
      for (size_t i = 0; i < 3; ++i)
        store_lanes(has ? turned.axis[i] : axis.axis[i], row + i * kBlockStrands);
    }
    start_before = before;
    start_after = after;
    is_start_moved = is_moved;
  }
}

STRANDCAST_LANES void correct_blocks_lanes(const CorrectWork& work) {
  for (uint32_t block = work.block_begin; block < work.block_end; ++block)
    for (uint32_t half = 0; half < kHalves; ++half)
      if (size_t{block} * kBlockStrands + half * kLaneCount < work.layout.no_neighbour())
        correct_half(work, block, half);
}

}  // namespace

STRANDCAST_KERNEL(expect_blocks, ExpectWork);
STRANDCAST_KERNEL(correct_blocks, CorrectWork);

}  // namespace strandcast::step
