#include "server/publish/block_quantise.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "common/strands/snapshot.h"

namespace strandcast {
namespace {

using simd::Float;
using simd::FloatBits;
using simd::IntBits;
using simd::kLanes;
using DoubleBits = double __attribute__((vector_size(8 * kLanes)));

static_assert(kBlockStrands % kLanes == 0);

STRANDCAST_LANES DoubleBits widened(const Float& x) {
  return __builtin_convertvector(x.v, DoubleBits);
}

STRANDCAST_LANES simd::vec3 load_vertex(const StrandBlocksView& blocks, uint32_t block, uint32_t vertex,
                                        uint32_t first_lane) {
  const float* const row = blocks.row(block, vertex, 0) + first_lane;
  return {simd::load_lanes(row), simd::load_lanes(row + kBlockStrands),
          simd::load_lanes(row + 2 * kBlockStrands)};
}

/// Negative where |x| is more than `most`, or x no number. As integers, since floats order alike and the
/// older instruction sets compare eight of them one by one.
STRANDCAST_LANES IntBits less_size(const Float& most, const Float& x) {
  return (IntBits)most.v - (IntBits)simd::abs(x).v;
}
STRANDCAST_LANES IntBits less_sizes(const Float& most, const simd::vec3& v) {
  return less_size(most, v.x) | less_size(most, v.y) | less_size(most, v.z);
}
/// -1 where negative, else 0.
STRANDCAST_LANES IntBits is_negative(const IntBits& x) {
  return x >> 31;
}

/// std::lrint of values within +-2^51: the sum has no digits behind the point.
STRANDCAST_LANES IntBits to_nearest(DoubleBits x) {
  constexpr double kWithoutFractions = 0x1.8p52;
  return __builtin_convertvector((x + kWithoutFractions) - kWithoutFractions, IntBits);
}

constexpr double kLimit = kMaxLattice - 1;

/// Whether positions beyond the last lattice value are brought back to it.
enum class Limits { None, Kept };

STRANDCAST_LANES IntBits lattice_value(const FloatBits& in_head_m, double steps_per_m, Limits limits) {
  DoubleBits steps = __builtin_convertvector(in_head_m, DoubleBits) * steps_per_m;
  if (limits == Limits::Kept) {
    steps = steps < -kLimit ? DoubleBits{} - kLimit : steps;
    steps = steps > kLimit ? DoubleBits{} + kLimit : steps;
  }
  return to_nearest(steps);
}

/// Nothing within it is beyond the last lattice value.
float lattice_reach_m(double steps_per_m) {
  return std::nextafter(static_cast<float>(kLimit / steps_per_m), 0.0f);
}

STRANDCAST_LANES void store_strands(const IntBits& values, uint32_t count, int32_t* to) {
  if (count == kLanes)
    std::memcpy(to, &values, sizeof values);
  else
    std::memcpy(to, &values, count * sizeof(int32_t));
}

/// Eight strands, those from `first_lane` of the block on. Whether one of them reaches beyond the lattice.
STRANDCAST_LANES bool quantise_part(const BlockQuantise& work, uint32_t block, uint32_t first_lane,
                                    Limits limits) {
  const uint32_t strand_count = work.position_m.strand_count;
  const uint32_t vertex_count = work.position_m.row_count;
  const uint32_t strand = block * kBlockStrands + first_lane;
  const uint32_t stored = strand < strand_count ? std::min(strand_count - strand, kLanes) : 0;
  const size_t plane_size = size_t{strand_count} * vertex_count;
  const auto turn =
      work.head_from_world;  // a copy: as far as the compiler knows, what is stored might be this
  const double steps_per_m = 1.0 / static_cast<double>(work.quantum_m);
  const Float lattice_m = lattice_reach_m(steps_per_m);
  const Float reach_m = work.reach_m;
  const Float finite = std::numeric_limits<float>::max();
  IntBits bad = {};
  IntBits stretched = {};
  IntBits far = {};
  simd::vec3 before = load_vertex(work.position_m, block, 0, first_lane);
  for (uint32_t vertex = 0; vertex < vertex_count; ++vertex) {
    const simd::vec3 point = load_vertex(work.position_m, block, vertex, first_lane);
    const simd::vec3 velocity = load_vertex(work.velocity_mps, block, vertex, first_lane);
    bad -= is_negative(less_sizes(reach_m, point) | less_sizes(finite, velocity));
    if (work.longest_squared_m2 != nullptr) {
      const simd::vec3 edge = point - before;
      const Float squared = (edge.x * edge.x + edge.y * edge.y) + edge.z * edge.z;
      const size_t row = (size_t{block} * vertex_count + vertex) * kBlockStrands;
      const Float longest = simd::load_lanes(work.longest_squared_m2 + row + first_lane);
      stretched -= is_negative(less_size(longest, squared));
      before = point;
    }
    const DoubleBits x = widened(point.x);
    const DoubleBits y = widened(point.y);
    const DoubleBits z = widened(point.z);
    int32_t* const to = work.lattice + size_t{vertex} * strand_count + strand;
    for (size_t axis = 0; axis < 3; ++axis) {
      const DoubleBits turned = turn[0][axis] * x + turn[1][axis] * y + turn[2][axis] * z;
      // Positions are floats in the whole program: this is the one rounding that the bound allows for.
      const FloatBits in_head_m = __builtin_convertvector(turned, FloatBits);
      far |= less_size(lattice_m, in_head_m);
      store_strands(lattice_value(in_head_m, steps_per_m, limits), stored, to + axis * plane_size);
    }
  }
  BlockFindings& findings = work.findings[block];
  std::memcpy(findings.bad_vertices.data() + first_lane, &bad, sizeof bad);
  std::memcpy(findings.stretched_segments.data() + first_lane, &stretched, sizeof stretched);
  findings.has_bad |= simd::is_any({bad});
  findings.has_stretched |= simd::is_any({stretched});
  return simd::is_any({is_negative(far)});
}

STRANDCAST_LANES void quantise_blocks_lanes(const BlockRange& range) {
  for (uint32_t block = range.begin; block < range.end; ++block) {
    BlockFindings& findings = range.work->findings[block];
    findings.has_bad = findings.has_stretched = false;
    for (uint32_t lane = 0; lane < kBlockStrands; lane += kLanes)
      if (quantise_part(*range.work, block, lane, Limits::None))
        quantise_part(*range.work, block, lane, Limits::Kept);
  }
}

}  // namespace

STRANDCAST_KERNEL(quantise_blocks, BlockRange);

}  // namespace strandcast
