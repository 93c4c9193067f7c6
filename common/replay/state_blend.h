// StateBlend: strands at any moment between known states, by the method that interpolation.h chooses. Pure
// logic; one thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>

#include "common/replay/interpolation.h"
#include "common/replay/strand_fill.h"
#include "common/strands/posed_strands.h"
#include "common/strands/snapshot.h"

namespace strandcast {

/// Returns the strands of one snapshot, filled up to all strands as the server draws them.
PosedStrands posed_strands_of(const Snapshot& snapshot, StrandFill& fill);

class StateBlend {
 public:
  /// Sets the fill for states without all strands, made from the asset's rest shape.
  void set_fill(StrandFill fill);
  /// Forgets the states of the last interpolation.
  void leave() { knots_ = {}; }

  PosedStrands at(const Snapshot& state) { return posed_strands_of(state, fill_); }
  /// Returns the strands at `sim_time_ns` between states `later - 1` and `later`; `states` are ordered by
  /// time. The method chosen for two states stays while moments between them are asked for, so that a change
  /// is never visible.
  PosedStrands between(const std::deque<std::shared_ptr<const Snapshot>>& states, size_t later,
                       int64_t sim_time_ns);
  /// Returns the interpolation of the newest strands.
  Interpolation interpolation() const { return chosen_; }

 private:
  /// Prepares states with all their strands, once for all moments that need them.
  struct Knot {
    std::shared_ptr<const Snapshot> snapshot;
    PosedStrands strands;
  };
  void enter(const std::deque<std::shared_ptr<const Snapshot>>& states, size_t later);

  StrandFill fill_;
  Interpolation chosen_ = Interpolation::None;  // between the inner two of knots_
  std::array<Knot, 4> knots_;                   // a line has no outer ones
};

}  // namespace strandcast
