#include "common/replay/state_blend.h"

#include <algorithm>
#include <utility>

namespace strandcast {

PosedStrands posed_strands_of(const Snapshot& snapshot, StrandFill& fill) {
  return PosedStrands{snapshot.world_from_head, fill.positions(snapshot),
                      bust_turn(snapshot.bust, snapshot.world_from_head.rotation)};
}

void StateBlend::set_fill(StrandFill fill) {
  fill_ = std::move(fill);
  knots_ = {};
}

/// Makes the strands of the states around the way to `later` that are not there from the way before.
void StateBlend::enter(const std::deque<std::shared_ptr<const Snapshot>>& states, size_t later) {
  if (knots_[1].snapshot == states[later - 1] && knots_[2].snapshot == states[later]) return;
  chosen_ = choose_interpolation(states, later);
  std::array<Knot, 4> next;
  const bool is_cubic = chosen_ == Interpolation::Cubic;
  for (size_t i = is_cubic ? 0 : 1; i < (is_cubic ? next.size() : next.size() - 1); ++i) {
    const auto& snapshot = states[later - 2 + i];
    const auto known = std::find_if(knots_.begin(), knots_.end(),
                                    [&](const Knot& knot) { return knot.snapshot == snapshot; });
    next[i] = known != knots_.end() ? std::move(*known) : Knot{snapshot, posed_strands_of(*snapshot, fill_)};
    // Without a rest shape a change to fewer strands leaves no cubic.
    if (next[i].strands.position_m.size() != next[is_cubic ? 0 : 1].strands.position_m.size())
      chosen_ = Interpolation::Linear;
  }
  knots_ = std::move(next);
}

PosedStrands StateBlend::between(const std::deque<std::shared_ptr<const Snapshot>>& states, size_t later,
                                 int64_t sim_time_ns) {
  enter(states, later);
  const int64_t from_ns = knots_[1].snapshot->sim_time_ns;
  const int64_t to_ns = knots_[2].snapshot->sim_time_ns;
  // Both have all strands, also when the stream has changed to one with fewer in between.
  if (chosen_ != Interpolation::Cubic)
    return blend(knots_[1].strands, knots_[2].strands,
                 static_cast<double>(sim_time_ns - from_ns) / static_cast<double>(to_ns - from_ns));
  const KnotTimes times = {knots_[0].snapshot->sim_time_ns, from_ns, to_ns, knots_[3].snapshot->sim_time_ns};
  return blend({&knots_[0].strands, &knots_[1].strands, &knots_[2].strands, &knots_[3].strands},
               cubic_terms(times, sim_time_ns));
}

}  // namespace strandcast
