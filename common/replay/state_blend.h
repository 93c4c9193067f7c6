// StateBlend: strands at any moment between known states, by whichever way between them interpolation.h
// chooses. Pure logic; one thread.
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

/// The strands of one snapshot, as the server draws them when it has all.
PosedStrands posed_strands_of(const Snapshot& snapshot, StrandFill& fill);

class StateBlend {
 public:
  /// For states without all strands, made from the asset's rest shape.
  void set_fill(StrandFill fill);
  /// Forgets the states that it was between.
  void leave() { knots_ = {}; }

  PosedStrands at(const Snapshot& state) { return posed_strands_of(state, fill_); }
  /// At `sim_time_ns` between states `later - 1` and `later` of these, the oldest first. What it chose
  /// between two states stays as long as it is asked for moments between them, so that a change is never
  /// seen.
  PosedStrands between(const std::deque<std::shared_ptr<const Snapshot>>& states, size_t later,
                       int64_t sim_time_ns);
  /// How the newest strands between two states were made.
  Interpolation interpolation() const { return chosen_; }

 private:
  /// A state with all its strands, made once for all moments that need it.
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
