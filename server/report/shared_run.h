// SharedRun: a recorded run whose strands go on from those of an encoder's viewers, as a server's do. Header
// only; one thread.
#pragma once

#include <cmath>
#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "common/base/units.h"
#include "common/strands/shared_strands.h"
#include "server/report/stream_codec.h"
#include "server/report/stream_recording.h"
#include "server/scene/shared_hair.h"

namespace strandcast {

/// Strands that go on from those of an encoder's viewers, whatever the recording has.
class SharedRun {
 public:
  explicit SharedRun(float quantum_m) : quantum_m_(quantum_m) {}
  bool is_active() const { return hair_.is_active(); }
  void step(const Snapshot& state) {
    if (is_active()) hair_.step(state.trail->ticks.back(), *state.trail->scene, 1.0 / kStreamFrameS);
  }
  std::shared_ptr<const SharedState> copy() const { return is_active() ? hair_.state() : nullptr; }
  /// The recording's state with these strands.
  Snapshot published(const StreamFrame& frame) {
    Snapshot state = on_lattice(frame, quantum_m_);
    // As the simulation counts it.
    state.sim_time_ns = std::llround(static_cast<double>(state.tick) * kStreamFrameS * kNsPerS);
    auto trail = std::make_shared<StepTrail>(*state.trail);
    trail->shared = hair_.number();
    state.trail = trail;
    return state;
  }
  void put_strands(Snapshot& state) {
    if (!is_active()) return;
    QuantiseInput input;
    static_cast<SnapshotInfo&>(input) = state;
    in_head_m_.clear();
    for (const glm::vec3& point : state_of(hair_.read_blocks()).position_m)
      in_head_m_.emplace_back(glm::conjugate(state.world_from_head.rotation) * glm::dvec3(point));
    input.position_in_head_m = in_head_m_;
    state = quantise(input).snapshot;
  }
  /// The strands of the last put_strands().
  const std::vector<glm::vec3>& in_head_m() const { return in_head_m_; }
  void follow(const std::shared_ptr<SharedUpdate>& update, const Snapshot& state) {
    if (update != nullptr) hair_.follow(*update, *state.trail, 1.0 / kStreamFrameS);
  }

 private:
  float quantum_m_;
  SharedHair hair_;
  std::vector<glm::vec3> in_head_m_;  // (vertex_count x strand_count), strand fastest
};

}  // namespace strandcast
