// SharedStrands: strands that a simulation steps as the viewers of the codec "step" do, with the same bits,
// from a state that all of them have. As long as it does, viewers need no corrections.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <span>

#include "common/base/result.h"
#include "common/kernels/step_model.h"
#include "common/kernels/strand_blocks.h"
#include "common/strands/strand_codec.h"

namespace strandcast {

/// Largest number of vertices that are shared, since a state is copied every tick.
inline constexpr size_t kMostSharedVertices = 400'000;

/// State that all viewers have after a frame, or will have. Immutable; any thread.
class SharedState {
 public:
  virtual ~SharedState() = default;
};

class SharedStrands {
 public:
  virtual ~SharedStrands() = default;
  /// Continues from a state of the same model.
  virtual void take(const SharedState& state) = 0;
  /// Simulates the tick, which ends at `end_time_ns` of simulated time.
  virtual void step(const StepTick& tick, const StepScene& scene, int64_t end_time_ns) = 0;
  /// Copies the whole state out, for an encoder that then needs no step of its own.
  virtual std::shared_ptr<const SharedState> state() = 0;
  /// Copies positions and velocities out, as SolverBlocks has them. Both have the groom's size.
  virtual void read(StrandBlocks& position_m, StrandBlocks& velocity_mps) const = 0;
};

/// Returns whether this is an exact frame: it carries only what a step cannot predict (WIRE.md, exact
/// frames).
bool is_exact(std::span<const std::byte> message);
inline bool is_exact(const EncodedFrame& frame) {
  return is_exact(frame.message);
}

/// What an encoder tells the simulation.
struct SharedUpdate {
  uint64_t number = 0;                     // counts the encoder's updates from 1
  uint64_t tick = 0;                       // of the state
  std::shared_ptr<const StepModel> model;  // as the snapshot's trail has it
  std::shared_ptr<const SharedState> state;
  /// Strands of this model, for the receiver alone; nullptr if they came with an earlier update.
  std::shared_ptr<SharedStrands> strands = {};
  bool is_told = false;   // by a keyframe, for which read_shared() gives the same state
  uint32_t sequence = 0;  // of the frame
};

/// Reads the state that a keyframe of "step" tells, with strands of its model; the update's model is the
/// caller's to set. Fails as a decoder, and where the keyframe tells no state of all strands.
Result<SharedUpdate> read_shared(std::span<const std::byte> keyframe, const StrandStreamLimits& limits,
                                 std::span<const glm::vec3> rest_in_head_m, WorkerPool& workers);

}  // namespace strandcast
