#include "server/report/scene_run.h"

#include "common/base/units.h"
#include "common/groom/groom_asset.h"
#include "server/sim/followed_solver.h"
#include "server/sim/solver_registry.h"
#include "server/source/scene_change.h"
#include "server/source/wet_hair.h"

namespace strandcast {

Result<std::unique_ptr<SceneRun>> SceneRun::make(const SceneDesc& scene, const SceneContent& content,
                                                 const RuntimeFacts& facts, Executor& executor) {
  RETURN_IF_ERROR(check_solver(scene));
  std::unique_ptr<SceneRun> run(new SceneRun(scene, executor));
  run->features_ = analyse(scene, facts);
  ASSIGN_OR_RETURN(const SolverRow* row, find_solver(scene.solver.name));
  ASSIGN_OR_RETURN(const SolverParameters parameters, moving_parameters(*row, scene));
  SolverContext context;
  context.executor = &executor;
  context.features = run->features_;
  context.groom_gravity_in_head_mps2 = scene.gravity_mps2;
  context.volume = moving_volume(scene, parameters);
  context.head_field = content.head_field;
  context.bend_limit = scene.bend_limit;
  ASSIGN_OR_RETURN(run->solver_, row->make(parameters, context));
  if (const SimulatedPart part = simulated_part(scene, facts, content.groom); !part.is_all())
    run->solver_ = std::make_unique<FollowedSolver>(std::move(run->solver_), part);
  RETURN_IF_ERROR(run->solver_->load(content.groom, glm::dquat(1.0, 0.0, 0.0, 0.0)));
  run->builder_.emplace(scene, content.colliders);
  ASSIGN_OR_RETURN(const float quantum_m, lattice_step_m(scene.stream.codec, scene.stream.bound_m));
  run->publisher_.emplace(content.groom, quantum_m);
  const StageSizes sizes{content.groom.strand_count(), content.groom.uniform_vertex_count(), scene.substeps,
                         static_cast<uint32_t>(content.colliders.size()),
                         content.head_field ? content.head_field->size_bytes() : 0};
  run->stages_.emplace(sizes, explain(scene, facts));
  run->stages_->set_solver_bytes(run->solver_->memory_bytes());
  run->stages_->set_watched(true);
  ASSIGN_OR_RETURN(run->encoder_, make_strand_encoder(scene.stream.codec));
  run->encoder_->set_rest_shape(make_scene_asset(content.groom, {}).rest_position_m);
  ASSIGN_OR_RETURN(const StrandCodecInfo codec, strand_codec_info(scene.stream.codec));
  if (codec.predicts) run->log_.set_model(run->solver_->step_model());
  return run;
}

Status SceneRun::step(const Pose& world_from_head) {
  const ScopedStage timed(step_timer_);
  ++tick_;
  StageTurn turn(*builder_, *solver_, *publisher_);
  turn.input.has_motion = true;
  turn.input.world_from_head = world_from_head;
  turn.end_time_s = static_cast<double>(tick_) / scene_.step_rate_hz;
  RETURN_IF_ERROR(stages_->step(turn, executor_.timer()));
  log_.add(builder_->step_tick(tick_));
  return {};
}

Result<std::shared_ptr<const Snapshot>> SceneRun::publish() {
  StageTurn turn(*builder_, *solver_, *publisher_);
  turn.publish.tick = tick_;
  turn.publish.sim_time_ns = std::llround(static_cast<double>(tick_) / scene_.step_rate_hz * kNsPerS);
  turn.publish.world_from_head = builder_->world_from_head();
  log_.set_scene(builder_->step_scene(features_));
  turn.publish.trail = log_.trail();
  RETURN_IF_ERROR(stages_->publish(turn));
  return turn.snapshot;
}

Result<size_t> SceneRun::encoded_bytes(const Snapshot& snapshot) {
  const EncodedFramePtr frame = encoder_->encode(snapshot);
  if (frame == nullptr) return make_error(ErrorCode::Internal, "a state could not be encoded");
  return frame->message.size();
}

uint64_t SceneRun::step_bytes() const {
  uint64_t bytes = 0;
  for (const gl::PassReport& pass : stages_->report())
    if (pass.fate == gl::PassFate::Kept && !pass.name.starts_with("publish/")) bytes += pass.size_bytes;
  return bytes;
}

}  // namespace strandcast
