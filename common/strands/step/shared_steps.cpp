#include "common/strands/step/shared_steps.h"

#include <algorithm>
#include <utility>

#include "common/base/hash.h"
#include "common/base/units.h"
#include "common/strands/step/exact_head.h"

namespace strandcast::step {

std::shared_ptr<PredictedState> StateCopies::make(const Predictor::State& state) {
  std::unique_ptr<PredictedState> copy;
  {
    const std::lock_guard lock(dropped_->mutex);
    if (!dropped_->states.empty()) {
      copy = std::move(dropped_->states.back());
      dropped_->states.pop_back();
    }
  }
  if (copy == nullptr) copy = std::make_unique<PredictedState>();
  Predictor::copy(state, copy->state);
  return {copy.release(), [dropped = dropped_](PredictedState* done) {
            std::unique_ptr<PredictedState> owned(done);
            const std::lock_guard lock(dropped->mutex);
            dropped->states.push_back(std::move(owned));
          }};
}

uint64_t told_after(uint64_t before, const ToldStep& step) {
  const uint64_t of_moment =
      hash_word(static_cast<uint64_t>(step.end_time_ns), hash_word(step.scene, before));
  return hash_bytes(step.tick, hash_bytes(std::as_bytes(std::span(&step.world_from_head, 1)), of_moment));
}

uint64_t told_from(const Moment& moment) {
  return told_after(moment.tick, {0, {}, moment.world_from_head, moment.sim_time_ns});
}

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
  now_.tick = from.tick;
  now_.told = from.told;
}

std::shared_ptr<const SharedState> SharedSteps::state() {
  std::shared_ptr<PredictedState> copy = copies_.make(predictor_->state());
  copy->base = now_.base;
  copy->lattice = now_.lattice;
  copy->quantum_m = now_.quantum_m;
  copy->tick = now_.tick;
  copy->told = now_.told;
  return copy;
}

void SharedSteps::step(const StepTick& tick, const StepScene& scene, int64_t end_time_ns) {
  if (!has_scene_ || !(scene == scene_)) {
    scene_ = scene;
    has_scene_ = true;
    std::vector<std::byte> bytes;
    told_scene_ = told_scene(scene, bytes);
    scene_hash_ = hash_bytes(bytes);
  }
  std::vector<std::byte> bytes;
  const std::vector<StepTick> ticks =
      told_ticks(std::span(&tick, 1), {tick.tick, tick.world_from_head}, told_scene_, now_.base, bytes);
  predictor_->set_scene(told_scene_);
  predictor_->advance({now_.lattice, now_.quantum_m}, ticks, static_cast<double>(end_time_ns) / kNsPerS);
  predictor_->expect(now_.quantum_m, now_.lattice);
  now_.tick = tick.tick;
  now_.told = told_after(now_.told, {scene_hash_, bytes, ticks.back().world_from_head, end_time_ns});
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

namespace strandcast {

bool is_exact(std::span<const std::byte> message) {
  return message.size() > kFrameHeaderBytes && message[0] == std::byte{uint8_t(Opcode::StrandDelta)} &&
         (message[kFrameHeaderBytes] & std::byte{step::kExactBit}) != std::byte{0};
}

}  // namespace strandcast
