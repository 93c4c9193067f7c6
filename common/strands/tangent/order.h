// Between snapshots, in the order of strands, and planes, in that of places, in which the "tangent" codec
// works. Private to common/strands/tangent.
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
/// One row of a snapshot into planes, limited to what decodes to valid lattice values. A kernel for every
/// instruction set.
void take_row(simd::InstructionSet set, const RowTaking& of);

struct HashedLattice {
  uint64_t state_hash = 0;
  bool is_valid = false;  // within +-kMaxLattice
};
/// What a snapshot with these positions has for a hash (state_hash).
uint64_t hash_planes(const Layout& layout, const Planes<int32_t>& planes, const SnapshotInfo& info);
/// The same, and the positions into `snapshot`, which has room for them.
HashedLattice give_planes(const Layout& layout, const Planes<int32_t>& planes, Snapshot& snapshot);

}  // namespace strandcast::tangent
