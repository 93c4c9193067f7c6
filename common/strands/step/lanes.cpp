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

/// `axis` after the smallest rotation that takes the unit vector a to the unit vector b; where that is nearly
/// half a turn, as it is.
STRANDCAST_LANES LaneVectors carried(const LaneVectors& axis, const LaneVectors& a, const LaneVectors& b) {
  constexpr float kLeastSum = 0.05f;  // of one and the cosine
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

STRANDCAST_LANES LaneVectors crossed(const LaneVectors& a, const LaneVectors& b) {
  LaneVectors result;
  for (size_t i = 0; i < 3; ++i) {
    const size_t j = (i + 1) % 3;
    const size_t k = (i + 2) % 3;
    result.axis[i] = a.axis[j] * b.axis[k] - a.axis[k] * b.axis[j];
  }
  return result;
}

/// At right angles to the unit vector `along`, and of unit length; as it is where nothing is left.
STRANDCAST_LANES LaneVectors across(const LaneVectors& axis, const LaneVectors& along) {
  constexpr float kLeast = 1e-6f;
  const Lanes part = dots(axis, along);
  LaneVectors result;
  for (size_t i = 0; i < 3; ++i) result.axis[i] = axis.axis[i] - part * along.axis[i];
  const Lanes squared = dots(result, result);
  const IntLanes has = squared > kLeast;
  const Lanes scale = 1.0f / square_roots(has ? squared : Lanes{} + 1.0f);
  for (size_t i = 0; i < 3; ++i) result.axis[i] = has ? result.axis[i] * scale : axis.axis[i];
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

STRANDCAST_LANES LaneVectors load_lattice(const tangent::Planes<int32_t>& planes, size_t at,
                                          float quantum_m) {
  LaneVectors point;
  for (size_t axis = 0; axis < 3; ++axis)
    point.axis[axis] = to_floats(load_lanes(planes[axis].data() + at)) * quantum_m;
  return point;
}

STRANDCAST_LANES void store_vector(const LaneVectors& vector, float* row) {
  for (size_t i = 0; i < 3; ++i) store_lanes(vector.axis[i], row + i * kBlockStrands);
}
STRANDCAST_LANES LaneVectors chosen(const IntLanes& which, const LaneVectors& a, const LaneVectors& b) {
  LaneVectors result;
  for (size_t i = 0; i < 3; ++i) result.axis[i] = which ? a.axis[i] : b.axis[i];
  return result;
}

/// What a step left of a vertex takes on its correction; numbers that none can be become 0.
STRANDCAST_LANES void gain(float* row, const LaneVectors& way, float scale, const IntLanes& takes) {
  constexpr float kMost = 1e4f;
  const LaneVectors before = load_vector(row);
  LaneVectors after;
  for (size_t i = 0; i < 3; ++i) after.axis[i] = before.axis[i] + scale * (takes ? way.axis[i] : Lanes{});
  store_vector(chosen(dots(after, after) < kMost * kMost, after, {}), row);
}

STRANDCAST_LANES void correct_half(const CorrectWork& work, uint32_t block, uint32_t half) {
  // Farther than a vertex is wrong by in a step: it was put there, and that is no motion.
  constexpr float kJumpM = 0.03f;
  const size_t place = size_t{block} * kBlockStrands + half * kLaneCount;
  const uint32_t lane = half * kLaneCount;
  LaneVectors start_before{};
  LaneVectors start_after{};
  bool is_start_moved = false;
  for (uint32_t v = 0; v < work.layout.vertex_count; ++v) {
    const size_t at = v * size_t{work.layout.stride} + place;
    IntLanes is_apart{};
    for (size_t axis = 0; axis < 3; ++axis)
      is_apart |= load_lanes(work.decoded[axis].data() + at) != load_lanes(work.expected[axis].data() + at);
    const bool is_moved = is_any(is_apart);
    float* position = work.position_m.row(block, v, 0) + lane;
    const bool has_axes = work.axis != nullptr;
    if (!is_moved && !is_start_moved && !has_axes) continue;
    const LaneVectors before = load_vector(position);
    LaneVectors after = before;
    if (is_moved) {
      const LaneVectors decoded =
          turned_by(work.world_from_head, load_lattice(work.decoded, at, work.quantum_m));
      after = chosen(is_apart, decoded, before);
      store_vector(after, position);
      if (v >= work.free_begin && v < work.free_end) {
        LaneVectors way;
        for (size_t i = 0; i < 3; ++i) way.axis[i] = after.axis[i] - before.axis[i];
        const IntLanes takes = is_apart & (dots(way, way) < kJumpM * kJumpM);
        gain(work.velocity_mps.row(block, v, 0) + lane, way, work.per_second, takes);
        if (work.way_m != nullptr) gain(work.way_m->row(block, v, 0) + lane, way, 1.0f, takes);
        if (work.velocity_change_mps != nullptr)
          gain(work.velocity_change_mps->row(block, v, 0) + lane, way, work.per_second, takes);
      }
    }
    if (has_axes && v >= 1 && (is_moved || is_start_moved)) {
      float* row = work.axis->row(block, v, 0) + lane;
      IntLanes has = IntLanes{} - 1;
      const LaneVectors a = direction_of(start_before, before, has);
      const LaneVectors b = direction_of(start_after, after, has);
      const LaneVectors axis = load_vector(row);
      store_vector(chosen(has, carried(axis, a, b), axis), row);
    }
    start_before = before;
    start_after = after;
    is_start_moved = is_moved;
  }
}

/// visit(block, lane, place) for all lanes with a strand among them.
template <class Visit>
STRANDCAST_LANES void for_halves(const tangent::Layout& layout, uint32_t begin, uint32_t end, Visit visit) {
  for (uint32_t block = begin; block < end; ++block)
    for (uint32_t half = 0; half < kHalves; ++half) {
      const size_t place = size_t{block} * kBlockStrands + half * kLaneCount;
      if (place < layout.no_neighbour()) visit(block, half * kLaneCount, place);
    }
}

STRANDCAST_LANES IntLanes strands_at(const tangent::Layout& layout, size_t place) {
  return load_lanes(layout.presence.data() + place) > 0.5f;
}

STRANDCAST_LANES void place_blocks_lanes(const PlaceWork& work) {
  const auto place_half = [&](uint32_t block, uint32_t lane, size_t place) STRANDCAST_LANES_LAMBDA {
    const IntLanes is_there = strands_at(work.layout, place);
    for (uint32_t v = 0; v < work.layout.vertex_count; ++v) {
      float* row = work.position_m.row(block, v, 0) + lane;
      const LaneVectors head =
          load_lattice(work.decoded, v * size_t{work.layout.stride} + place, work.quantum_m);
      store_vector(chosen(is_there, turned_by(work.world_from_head, head), load_vector(row)), row);
    }
  };
  for_halves(work.layout, work.block_begin, work.block_end, place_half);
}

STRANDCAST_LANES void start_blocks_lanes(const StartWork& work) {
  constexpr float kMostStartMps = 20.0f;  // what is faster jumped
  const auto start_half = [&](uint32_t block, uint32_t lane, size_t place) STRANDCAST_LANES_LAMBDA {
    const IntLanes is_there = strands_at(work.layout, place);
    for (uint32_t v = 0; v < work.layout.vertex_count; ++v) {
      const LaneVectors head =
          load_lattice(work.before, v * size_t{work.layout.stride} + place, work.quantum_m);
      const LaneVectors was = turned_by(work.world_from_head, head);
      const LaneVectors now = load_vector(work.position_m.row(block, v, 0) + lane);
      LaneVectors speed;
      for (size_t i = 0; i < 3; ++i)
        speed.axis[i] = (now.axis[i] - (was.axis[i] + work.shift_m[i])) * work.per_second;
      const IntLanes has = is_there & (dots(speed, speed) < kMostStartMps * kMostStartMps);
      store_vector(chosen(has, speed, {}), work.velocity_mps.row(block, v, 0) + lane);
    }
  };
  for_halves(work.layout, work.block_begin, work.block_end, start_half);
}

STRANDCAST_LANES void turn_blocks_lanes(const TurnWork& work) {
  for (uint32_t block = work.block_begin; block < work.block_end; ++block)
    for (uint32_t v = 0; v < work.vectors.row_count(); ++v)
      for (uint32_t lane = 0; lane < kBlockStrands; lane += kLaneCount) {
        float* row = work.vectors.row(block, v, 0) + lane;
        store_vector(turned_by(work.by, load_vector(row)), row);
      }
}

// What direct_rod's kernel does for a strand that it puts back to rest.
STRANDCAST_LANES void axes_blocks_lanes(const AxesWork& work) {
  for (uint32_t block = work.block_begin; block < work.block_end; ++block)
    for (uint32_t lane = 0; lane < kBlockStrands; lane += kLaneCount) {
      LaneVectors before =
          turned_by(work.world_from_head, load_vector(work.rod_strand.row(block, 0, 0) + lane));
      LaneVectors axis =
          turned_by(work.world_from_head, load_vector(work.rod_strand.row(block, 1, 0) + lane));
      for (uint32_t v = work.first; v < work.position_m.row_count(); ++v) {
        IntLanes has = IntLanes{} - 1;
        const LaneVectors found = direction_of(load_vector(work.position_m.row(block, v - 1, 0) + lane),
                                               load_vector(work.position_m.row(block, v, 0) + lane), has);
        const LaneVectors direction = chosen(has, found, before);
        if (v > work.first) {
          const LaneVectors joint = load_vector(work.rod_edge.row(block, v, 0) + lane);
          const LaneVectors side = crossed(before, axis);
          LaneVectors tangent;
          for (size_t i = 0; i < 3; ++i)
            tangent.axis[i] = (joint.axis[0] * axis.axis[i] + joint.axis[1] * side.axis[i]) +
                              joint.axis[2] * before.axis[i];
          const Lanes twice = 2.0f * dots(tangent, before);
          LaneVectors unstrained;
          for (size_t i = 0; i < 3; ++i) unstrained.axis[i] = twice * tangent.axis[i] - before.axis[i];
          axis = carried(axis, before, unstrained);
          before = unstrained;
        }
        axis = across(carried(axis, before, direction), direction);
        store_vector(axis, work.axis.row(block, v, 0) + lane);
        before = direction;
      }
    }
}

/// Whole steps, limited.
STRANDCAST_LANES Lanes whole_steps(const Lanes& steps) {
  const Lanes low = steps > -kMostSteps ? steps : Lanes{} - kMostSteps;  // also what is no number
  return to_floats(tangent::nearest_lanes(low < kMostSteps ? low : Lanes{} + kMostSteps));
}

STRANDCAST_LANES void settle_blocks_lanes(const SettleWork& work) {
  const float per_step = 1.0f / work.step;
  const float per_w_step = work.w_step > 0.0f ? 1.0f / work.w_step : 0.0f;
  for (uint32_t block = work.block_begin; block < work.block_end; ++block)
    for (uint32_t lane = 0; lane < kBlockStrands; lane += kLaneCount) {
      Lanes seconds = Lanes{} + 1.0f;
      if (work.seconds != nullptr) seconds = load_lanes(work.seconds->row(block, 0, 3) + lane);
      for (uint32_t v = 0; v < work.vectors.row_count(); ++v) {
        float* row = work.vectors.row(block, v, 0) + lane;
        LaneVectors about{};
        if (work.about != nullptr) about = load_vector(work.about->row(block, v, 0) + lane);
        for (size_t i = 0; i < 3; ++i) {
          const Lanes expected = seconds * about.axis[i];
          const Lanes value = load_lanes(row + i * kBlockStrands);
          store_lanes(expected + work.step * whole_steps((value - expected) * per_step),
                      row + i * kBlockStrands);
        }
        float* w = row + 3 * kBlockStrands;
        if (work.w_step == 0.0f)
          store_lanes(Lanes{}, w);
        else if (v > 0)
          store_lanes(work.w_step * whole_steps(load_lanes(w) * per_w_step), w);
      }
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
STRANDCAST_KERNEL(place_blocks, PlaceWork);
STRANDCAST_KERNEL(start_blocks, StartWork);
STRANDCAST_KERNEL(turn_blocks, TurnWork);
STRANDCAST_KERNEL(axes_blocks, AxesWork);
STRANDCAST_KERNEL(settle_blocks, SettleWork);

}  // namespace strandcast::step
