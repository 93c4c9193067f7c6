// Steps: the part that the "step" codec adds to a chain of "tangent" frames. It decides whether a frame is
// predicted by solver steps or by motion, and codes that decision. One class for each side. Private to
// common/strands; one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/strands/byte_io.h"
#include "common/strands/snapshot.h"
#include "common/strands/step/predictor.h"
#include "common/strands/step/shared_steps.h"
#include "common/strands/step/step_reader.h"
#include "common/strands/step/wire.h"
#include "common/strands/tangent/motion.h"

namespace strandcast::step {

/// State and functions that encoder and decoder share.
class Steps {
 public:
  /// After an anchor: rounds the state to the one that joiners receive.
  void settle(const tangent::History& history);

 protected:
  Steps(WorkerPool& workers, simd::InstructionSet set) : workers_(workers), set_(set) {}
  PredictorGround ground(const tangent::Layout& layout) const {
    return {layout, rest_in_head_m_, workers_, set_};
  }
  /// Simulates the ticks and stores the predicted positions in expected_.
  void step(std::span<const StepTick> ticks, const Moment& now, const tangent::Layout& layout,
            tangent::History& history);
  /// Takes over a finished frame; `frame.lattice` holds what `history.lattice` held before.
  void follow(const Moment& now, const tangent::Frame& frame, const tangent::History& history);
  void follow_exact(const Moment& now);

  WorkerPool& workers_;
  simd::InstructionSet set_;
  std::vector<glm::vec3> rest_in_head_m_;
  std::unique_ptr<Predictor> predictor_;
  std::unique_ptr<Predictor> next_predictor_;  // of a model that came with the frame
  StepScene scene_;
  TickBase base_;
  Moment last_;
  tangent::Planes<int32_t> expected_;
  bool is_stepping_ = false;
  bool is_following_ = false;                // steps were taken, and predict nothing
  Rounding rounding_ = Rounding::Coarse;     // of the anchor at work
  std::optional<VelocityGuess> told_guess_;  // of the same; the encoder's is found
  uint32_t age_ = 0;                         // frames since strands started without velocities
};

class EncoderSteps : public Steps {
 public:
  EncoderSteps(WorkerPool& workers, simd::InstructionSet set) : Steps(workers, set) {}
  void set_rest_shape(std::span<const glm::vec3> rest_in_head_m);
  /// Begins a chain with an empty state.
  void restart(const SnapshotInfo& snapshot, const tangent::Layout& layout);
  /// As StrandEncoder::set_state().
  void set_state(std::shared_ptr<const SharedState> state) {
    told_state_ = std::static_pointer_cast<const PredictedState>(std::move(state));
  }
  /// Begins a frame: says what acts.
  void begin(const SnapshotInfo& snapshot, const tangent::Layout& layout);
  /// After begin(): whether the simulation has taken the viewers' step already (set_state()). predict() then
  /// leaves the target alone, which is the history's lattice.
  bool is_handing() const { return is_handing_; }
  /// Decides how the frame is predicted. Returns its flags; append_bytes() writes the bytes that follow them.
  /// Sets the target to the prediction if the simulation has taken the viewers' step, or is about to take
  /// their state over.
  uint8_t predict(const SnapshotInfo& snapshot, const tangent::Layout& layout, tangent::History& history,
                  tangent::Planes<int32_t>& target);
  /// The frame at work becomes an anchor.
  void begin_anchor(Rounding rounding) { rounding_ = rounding; }
  /// `head`: of an exact frame.
  void append_bytes(std::span<const std::byte> head, std::vector<std::byte>& body) const;
  /// Returns the pose of the chest after the newest step.
  BustCode chest() const { return base_.chest; }
  void finish(const SnapshotInfo& snapshot, const tangent::Frame& frame, const tangent::History& history);
  void finish_exact(const SnapshotInfo& snapshot);
  /// After an anchor: rounds the state to the one that joiners receive.
  void settle(const tangent::History& history);
  /// Returns how many ticks were simulated here.
  uint64_t step_count() const { return step_count_; }
  /// Appends the state for a joiner; call settle() first.
  void append_state(std::vector<std::byte>& body);
  /// As StrandEncoder::take_shared(), after a frame.
  std::shared_ptr<SharedUpdate> take_shared(SharedStates which, const tangent::Layout& layout,
                                            const tangent::History& history);

 private:
  uint8_t say(const SnapshotInfo& snapshot, const tangent::Layout& layout);
  bool hands(const StepTrail& trail, const SnapshotInfo& snapshot);
  void end(const SnapshotInfo& snapshot, bool is_disturbed);
  bool is_waiting(const SnapshotInfo& snapshot) const;
  std::span<const StepTick> ticks_since(const SnapshotInfo& snapshot) const;
  uint8_t judge(const tangent::Layout& layout, const tangent::History& history,
                const tangent::Planes<int32_t>& target) const;
  void take_scene(const StepScene& scene);
  void own_state();
  bool take_model(const std::shared_ptr<const StepModel>& model, const tangent::Layout& layout);

  std::shared_ptr<const StepModel> told_model_;
  bool has_model_ = false;  // that this build can step
  std::shared_ptr<const StepScene> told_scene_;
  std::vector<std::byte> model_bytes_;
  // Of the frame at work.
  std::vector<std::byte> bytes_;                // that its flags announce
  std::vector<std::byte> said_;                 // of its ticks
  std::optional<std::vector<StepTick>> ticks_;  // as viewers read them; none: no steps lead to it
  TickBase next_base_;
  uint64_t next_told_ = 0;
  uint8_t flags_ = 0;
  bool is_handing_ = false;
  bool is_settled_ = false;  // a keyframe has its state

  bool is_disturbed_ = false;                      // more than a step a frame acted since take_shared()
  std::shared_ptr<const StepModel> shared_model_;  // whose strands were given away
  uint64_t shared_number_ = 0;                     // of the newest update
  uint64_t shared_tick_ = 0;                       // of its state
  StateCopies shared_states_;
  uint64_t scene_hash_ = 0;  // of the told scene's bytes
  uint64_t told_ = 0;        // PredictedState::told of viewers since the newest update
  uint64_t step_count_ = 0;
  /// The simulation's.
  std::shared_ptr<const PredictedState> told_state_;  // of the frame at work
  std::shared_ptr<const PredictedState> handed_;      // of the last frame; nullptr: the predictor's own is it
};

class DecoderSteps final : public Steps, public StepReader {
 public:
  DecoderSteps(WorkerPool& workers, simd::InstructionSet set) : Steps(workers, set) {}
  void restart(std::span<const glm::vec3> rest_in_head_m) override;
  Status begin(const Beginning& beginning, const Moment& now, const tangent::Layout& layout, ByteReader& body,
               tangent::History& history) override;
  BustCode chest() const override { return base_.chest; }
  void abandon(tangent::History& history) override;
  void finish(const Moment& now, const tangent::Frame& frame, const tangent::History& history) override;
  void finish_exact(const Moment& now) override { follow_exact(now); }
  void settle(const tangent::History& history) override;
  Result<Rounding> read_state(ByteReader& body, const Moment& now, const tangent::Layout& layout,
                              Rounding fine) override;
  void take_over(const Moment& now, const tangent::History& history) override;
  /// Keeps what the next keyframe tells, for take_shared().
  void keep_shared() { keeps_shared_ = true; }
  /// Returns the strands of the last keyframe, as a simulation goes on from them; null if it told of none.
  std::shared_ptr<SharedUpdate> take_shared() { return std::move(shared_); }

 private:
  /// State read from a keyframe.
  struct Joined {
    std::unique_ptr<Predictor> predictor;  // nullptr: nothing is predicted by steps yet
    StepScene scene;
    TickBase base;
  };

  Joined joined_;  // until take_over()
  bool keeps_shared_ = false;
  std::shared_ptr<SharedUpdate> shared_;
  StepScene saved_scene_;
  TickBase saved_base_;
  bool is_saved_ = false;
};

}  // namespace strandcast::step
