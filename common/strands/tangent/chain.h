// Chain: what a stream of the "tangent" or "step" codec remembers on both sides from frame to frame. Header
// only; private to common/strands/tangent. One thread.
#pragma once

#include <utility>

#include "common/strands/step/exact_head.h"
#include "common/strands/tangent/motion.h"
#include "common/strands/tangent/sparse_symbols.h"
#include "common/strands/tangent/symbols.h"

namespace strandcast::tangent {

/// What a stream remembers on both sides.
struct Chain {
  History history;
  SymbolSizes sizes;
  Tables tables = make_first_tables();
  // Of the "step" codec only.
  SparseTables sparse_tables = make_first_sparse_tables();
  BlockCounts blocks;
  step::HeadBase head;
  bool has_integers = false;  // any of sizes and blocks is not 0

  void reset(const Layout& layout) {
    history.reset(layout);
    has_integers = true;
    forget_integers(layout);
    forget_tables();
  }
  /// After a fine anchor: what frames of steps learnt says nothing of it.
  void forget_tables() {
    tables = make_first_tables();
    sparse_tables = make_first_sparse_tables();
  }
  /// After an anchor: what a joiner knows, and no more. The tables stay.
  void forget_motion(const Layout& layout) {
    history.forget_motion();
    forget_integers(layout);
  }
  /// Sizes of a frame's integers; blocks are told beside them.
  void learn(SymbolSizes& now) {
    std::swap(sizes, now);
    has_integers = true;
  }
  void forget_integers(const Layout& layout) {
    if (!std::exchange(has_integers, false)) return;
    sizes.reset(layout);
    blocks.assign(block_count_of(layout), 0);
  }
};

}  // namespace strandcast::tangent
