// A groom of a few of another's strands, for laws that need no more of them.
#pragma once

#include <algorithm>
#include <cstdint>

#include "common/groom/groom.h"

namespace strandcast::test {

/// Every n-th strand, as many as asked for.
inline Groom some_strands(const Groom& groom, uint32_t strand_count) {
  Groom some;
  some.name = groom.name;
  some.offset.push_back(0);
  const uint32_t taken = std::min(strand_count, groom.strand_count());
  for (uint32_t k = 0; k < taken; ++k) {
    const auto s = static_cast<uint32_t>(uint64_t{k} * groom.strand_count() / taken);
    for (uint32_t i = groom.offset[s]; i < groom.offset[s + 1]; ++i) {
      some.rest_position_m.push_back(groom.rest_position_m[i]);
      some.pinned.push_back(groom.pinned[i]);
    }
    some.offset.push_back(static_cast<uint32_t>(some.rest_position_m.size()));
  }
  return some;
}

}  // namespace strandcast::test
