#include "common/strands/tangent/order.h"

#include <algorithm>

#include "common/base/hash.h"
#include "common/simd/raw_lanes.h"

namespace strandcast::tangent {
namespace {

using namespace simd::raw;

// What decodes to within the bound of this is still a valid lattice value.
constexpr int32_t kFarthestTarget = kMaxLattice - 2 * kStepsPerBound;

STRANDCAST_LANES void take_row_lanes(const RowTaking& of) {
  const Layout& layout = of.layout;
  const int32_t* const from = of.snapshot.lattice.data() + of.axis * of.snapshot.plane_size() +
                              of.vertex * size_t{layout.strand_count};
  int32_t* const to = of.planes[of.axis].data() + of.vertex * size_t{layout.stride};
  for (uint32_t slice = 0; slice < layout.slice_count(); ++slice) {
    size_t place = layout.slice_begin[slice];
    const size_t end = place + layout.strands_in[slice];
    for (; place + kLaneCount <= end; place += kLaneCount) {
      const IntLanes value = gather_lanes(from, layout.strand_at.data() + place);
      const IntLanes least = value > -kFarthestTarget ? value : IntLanes{} - kFarthestTarget;
      store_lanes(least < kFarthestTarget ? least : IntLanes{} + kFarthestTarget, to + place);
    }
    for (; place < end; ++place)
      to[place] = std::clamp(from[layout.strand_at[place]], -kFarthestTarget, kFarthestTarget);
  }
}

/// The hash of lattice values in the order of a snapshot. visit(index, value) sees each on the way: a step of
/// the hash waits for the one before it, and all else is done meanwhile.
template <class Visit>
uint64_t hash_in_order(const Layout& layout, const Planes<int32_t>& planes, uint64_t hash, Visit visit) {
  size_t index = 0;
  bool is_half = false;  // a word of 64 bits holds two values
  uint32_t half = 0;
  const auto value_at = [&](const int32_t* row, size_t strand) {
    const int32_t value = row[layout.place_of[strand]];
    visit(index++, value);
    return static_cast<uint32_t>(value);
  };
  const auto pair_of = [](uint32_t first, uint32_t second) { return uint64_t{second} << 32 | first; };
  for (const auto& plane : planes) {
    for (uint32_t v = 0; v < layout.vertex_count; ++v) {
      const int32_t* const row = plane.data() + v * size_t{layout.stride};
      size_t strand = 0;
      if (is_half) hash = hash_word(pair_of(half, value_at(row, strand++)), hash);
      for (; strand + 2 <= layout.strand_count; strand += 2) {
        const uint32_t first = value_at(row, strand);
        hash = hash_word(pair_of(first, value_at(row, strand + 1)), hash);
      }
      is_half = strand < layout.strand_count;
      if (is_half) half = value_at(row, strand);
    }
  }
  return is_half ? hash_bytes(std::as_bytes(std::span(&half, 1)), hash) : hash;
}

}  // namespace

STRANDCAST_KERNEL(take_row, RowTaking);

uint64_t hash_planes(const Layout& layout, const Planes<int32_t>& planes, const SnapshotInfo& info) {
  return hash_in_order(layout, planes, info_hash(info), [](size_t, int32_t) {});
}

HashedLattice give_planes(const Layout& layout, const Planes<int32_t>& planes, Snapshot& snapshot) {
  HashedLattice result;
  result.is_valid = true;
  result.state_hash = hash_in_order(layout, planes, info_hash(snapshot), [&](size_t index, int32_t value) {
    snapshot.lattice[index] = value;
    result.is_valid &= value > -kMaxLattice && value < kMaxLattice;
  });
  return result;
}

}  // namespace strandcast::tangent
