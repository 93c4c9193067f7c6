#include "common/strands/step/shared_steps.h"

#include <algorithm>
#include <utility>

#include "common/base/units.h"

namespace strandcast::step {

Result<std::shared_ptr<SharedSteps>> SharedSteps::make(StepModel model,
                                                       std::span<const glm::vec3> rest_in_head_m,
                                                       WorkerPool& workers, simd::InstructionSet set) {
  std::shared_ptr<SharedSteps> steps(new SharedSteps(rest_in_head_m));
  steps->layout_ = tangent::make_layout(model.strand_count, model.vertex_count, steps->rest_in_head_m_);
  const PredictorGround ground{steps->layout_, steps->rest_in_head_m_, workers, set, Priority::Simulation};
  ASSIGN_OR_RETURN(steps->predictor_, Predictor::make(std::move(model), ground));
  return steps;
}

void SharedSteps::take(const SharedState& state) {
  const auto& from = static_cast<const PredictedState&>(state);
  predictor_->set_state(from.state);
  now_.base = from.base;
  now_.lattice = from.lattice;
  now_.quantum_m = from.quantum_m;
}

void SharedSteps::step(const StepTick& tick, const StepScene& scene, int64_t end_time_ns) {
  if (!has_scene_ || !(scene == scene_)) {
    scene_ = scene;
    has_scene_ = true;
    std::vector<std::byte> bytes;
    told_scene_ = told_scene(scene, bytes);
  }
  std::vector<std::byte> bytes;
  const std::vector<StepTick> ticks =
      told_ticks(std::span(&tick, 1), {tick.tick, tick.world_from_head}, told_scene_, now_.base, bytes);
  predictor_->set_scene(told_scene_);
  predictor_->advance({now_.lattice, now_.quantum_m}, ticks, static_cast<double>(end_time_ns) / kNsPerS);
  predictor_->expect(now_.quantum_m, now_.lattice);
}

void SharedSteps::read(StrandBlocks& position_m, StrandBlocks& velocity_mps) const {
  const Predictor::State& state = predictor_->state();
  const auto gather = [&](PlaneRole role, StrandBlocks& to) {
    const StrandBlocks& from = *state.planes[static_cast<size_t>(role)];
    for (uint32_t block = 0; block < block_count(to.strand_count()); ++block)
      for (uint32_t lane = 0; lane < kBlockStrands; ++lane) {
        const uint32_t strand = std::min(block * kBlockStrands + lane, to.strand_count() - 1);
        const uint32_t place = layout_.place_of[strand];
        const uint32_t from_block = place / kBlockStrands;
        const uint32_t from_lane = place % kBlockStrands;
        for (uint32_t v = 0; v < to.row_count(); ++v)
          for (uint32_t axis = 0; axis < 3; ++axis)
            to.row(block, v, axis)[lane] = from.row(from_block, v, axis)[from_lane];
      }
  };
  gather(PlaneRole::Position, position_m);
  gather(PlaneRole::Velocity, velocity_mps);
}

}  // namespace strandcast::step
