// Converts between snapshots, in strand order, and the planes of the "tangent" codec, in coding order.
// Private to common/strands/tangent.
#pragma once

#include <cstdint>
#include <span>

#include "common/strands/snapshot.h"
#include "common/strands/tangent/motion.h"

namespace strandcast::tangent {

struct RowTaking {
  const Layout& layout;
  const Snapshot& snapshot;
  Planes<int32_t>& planes;  // of the layout's size, 0 where there is no strand
  size_t axis;
  uint32_t vertex;
};
/// Copies one row of a snapshot into planes, clamped to values that decode to valid lattice values. A kernel
/// for every instruction set.
void take_row(simd::InstructionSet set, const RowTaking& of);

struct HashedLattice {
  uint64_t state_hash = 0;
  bool is_valid = false;  // within +-kMaxLattice
};
/// Returns the state_hash() of a snapshot with these positions.
uint64_t hash_planes(const Layout& layout, const Planes<int32_t>& planes, const SnapshotInfo& info);
/// Returns the same hash and writes the positions into `snapshot`, which must have room for them.
HashedLattice give_planes(const Layout& layout, const Planes<int32_t>& planes, Snapshot& snapshot);

}  // namespace strandcast::tangent
