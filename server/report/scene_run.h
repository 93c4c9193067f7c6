// SceneRun: a scene's own simulation under a head motion, step by step, as the server runs it: passes,
// publisher and codec. Runs on the executor's thread; the executor must outlive it.
#pragma once

#include <memory>
#include <optional>

#include "common/base/profile.h"
#include "common/scene/features.h"
#include "common/strands/strand_codec.h"
#include "server/publish/publisher.h"
#include "server/scene/scene_content.h"
#include "server/scene/step_builder.h"
#include "server/scene/step_log.h"
#include "server/sim/executor/executor.h"
#include "server/source/sim_stages.h"

namespace strandcast {

class SceneRun {
 public:
  /// Makes a run with hair at rest under an upright head. `content` must outlive it.
  static Result<std::unique_ptr<SceneRun>> make(const SceneDesc& scene, const SceneContent& content,
                                                const RuntimeFacts& facts, Executor& executor);

  /// Advances one step of the scene's rate; `world_from_head` is the pose at its end.
  Status step(const Pose& world_from_head);
  Result<std::shared_ptr<const Snapshot>> publish();
  /// Returns the bytes of a state for a receiver of all earlier ones; the first is a keyframe.
  Result<size_t> encoded_bytes(const Snapshot& snapshot);

  double step_median_ms() const { return step_timer_.median_ms(); }
  gl::PassReports passes() const { return stages_->report(); }
  uint64_t solver_bytes() const { return solver_->memory_bytes(); }
  /// Returns the bytes of solver and step.
  uint64_t step_bytes() const;
  uint64_t tick() const { return tick_; }

 private:
  SceneRun(const SceneDesc& scene, Executor& executor) : scene_(scene), executor_(executor) {}

  SceneDesc scene_;
  Executor& executor_;
  SceneFeatures features_;
  std::unique_ptr<Solver> solver_;
  std::optional<StepBuilder> builder_;
  std::optional<Publisher> publisher_;
  std::optional<SimStages> stages_;
  std::unique_ptr<StrandEncoder> encoder_;
  StepLog log_;
  StageTimer step_timer_;
  uint64_t tick_ = 0;
};

}  // namespace strandcast
