// SimStages: the stages of a simulation step and of publishing, as passes in two lists. The loop runs them;
// --explain prints and times the same passes. They own none of the objects they work on. Simulation thread.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/gl/pass_list.h"
#include "common/scene/features.h"
#include "server/input/input_frame.h"
#include "server/publish/publisher.h"
#include "server/scene/shared_hair.h"
#include "server/scene/step_builder.h"
#include "server/sim/solver.h"

namespace strandcast {

/// Number of steps between reading back states while nobody watches; this still finds broken strands.
inline constexpr uint64_t kIdlePublishSteps = 30;

/// Objects that the stages work on, with the inputs and outputs of one turn.
struct StageTurn : gl::PassTurn {
  struct Setup {};  // nothing to prepare: solvers are built by whoever owns them
  StageTurn(StepBuilder& step_builder, Solver& of_strands, Publisher& of_snapshots)
      : builder(step_builder), solver(of_strands), publisher(of_snapshots) {}

  StepBuilder& builder;
  Solver& solver;
  Publisher& publisher;
  // A step takes
  InputFrame input;
  double end_time_s = 0.0;  // of the step, simulated
  double input_rate = 1.0;  // InputClock::rate()
  bool is_carried = false;  // strands went along with a jump of the head
  // Steps the strands instead of the solver, and needs the three after it; may be null.
  SharedHair* shared = nullptr;
  uint64_t tick = 0;
  double step_rate_hz = 0.0;
  const SceneFeatures* features = nullptr;
  const std::atomic<bool>* is_stopping = nullptr;  // looked at between substeps; may be null
  // Publishing takes, besides how the head moved in the newest step,
  PublishInput publish;
  // and gives
  std::shared_ptr<const Snapshot> snapshot;
};

/// Sizes that are known before there is any GL.
struct StageSizes {
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;
  uint32_t substeps = 1;
  uint32_t collider_count = 0;
  uint64_t field_bytes = 0;  // of the head's distance field
};

class SimStages {
 public:
  /// Plans the passes; `reasons` are explain()'s for the facts that decide.
  SimStages(const StageSizes& sizes, const std::vector<FeatureReason>& reasons);
  /// Plans and times the step anew after a change of facts, solver or substeps.
  void plan_step(uint32_t substeps, const std::vector<FeatureReason>& reasons);
  /// Sets the bytes that the solver actually uses.
  void set_solver_bytes(uint64_t size_bytes) { state_->bytes = size_bytes; }
  /// Sets whether anybody reads what is published. It affects only the report; the loop decides when to
  /// publish.
  void set_watched(bool is_watched) { is_watched_ = is_watched; }

  /// Runs the step; it ends early if told to stop, and then its state must not be published. Without a
  /// device, its time is measured on this thread.
  Status step(StageTurn& turn, gl::GpuTimer* device) { return step_->run(turn, device); }
  Status publish(StageTurn& turn) { return publish_->run(turn, nullptr); }

  /// Returns the solver's duration in the last step.
  double last_step_ms() const { return step_->last_ms("sim/step"); }
  gl::PassReports report() const;

 private:
  /// Plans publishing; `follows`: whether strands that are not simulated follow simulated ones.
  void plan_publish(const FeatureReason& follows);
  struct KnownLater final : gl::Resource {
    KnownLater(std::string name, uint64_t bytes_at_most) : Resource(std::move(name)), bytes(bytes_at_most) {}
    uint64_t size_bytes() const override { return bytes; }
    uint64_t bytes;
  };

  StageSizes sizes_;
  gl::Resource input_{"input"};  // from outside
  std::unique_ptr<KnownLater> state_;
  gl::Resource followed_{"followed strands"};  // the solver's, counted with its state
  gl::Resource host_state_;
  gl::Resource snapshot_;
  std::unique_ptr<gl::PassList<StageTurn>> step_;
  std::unique_ptr<gl::PassList<StageTurn>> publish_;
  FeatureReason publish_planned_for_;  // whether anything follows
  bool is_watched_ = false;
};

}  // namespace strandcast
