#include "server/sim/gpu_solver.h"

#include <epoxy/gl.h>

#include "common/base/check.h"
#include "shaders/shared/bindings.h"

namespace strandcast {

GpuSolver::GpuSolver(const GpuSolverContext& context, const StrandParameters& parameters)
    : strands_(context.strands ? context.strands : std::make_shared<StrandState>()),
      parameters_(parameters),
      features_(context.features),
      step_("step", sizeof(StepBlock)) {
  CHECK(context.shaders != nullptr);
  shaders_ = *context.shaders;
}

namespace {

// The next kernel fetches what this one stored; read() copies it.
void show_strands() {
  glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT |
                  GL_BUFFER_UPDATE_BARRIER_BIT);
}

}  // namespace

Status GpuSolver::prepare_all() {
  RETURN_IF_ERROR(prepare());
  if (!features_.has_follicle_limit) return {};
  ASSIGN_OR_RETURN(follicle_limit_, FollicleLimit::make(shaders_, features_, layout(), carried()));
  return {};
}

Status GpuSolver::load(const Groom& groom, const glm::dquat& world_from_head_rotation) {
  RETURN_IF_ERROR(strands_->load(groom, world_from_head_rotation));
  RETURN_IF_ERROR(prepare_all());
  begin();
  return {};
}

Status GpuSolver::follow() {
  RETURN_IF_ERROR(prepare_all());
  strands_->forget_model();
  begin();
  return {};
}

void GpuSolver::substep(const StepInput& input) {
  adapt(input);
  const StepBlock block = make_step_block(input, parameters_, layout(), strands_->head());
  step_.write(0, std::as_bytes(std::span(&block, 1)));
  step_.bind_uniform(shader::kBindingStep);
  strands_->bind();
  const gl::Program& program = programs().fitting(input.colliders.size());
  program.use();
  run(program);
  show_strands();
  if (follicle_limit_ && FollicleLimit::holds(input, layout())) {
    follicle_limit_->run(input, layout(), carried());
    show_strands();
  }
  strands_->advance(input);
}

// A strand that is written as it was read goes on as if nothing had happened; another one starts anew.
void GpuSolver::write(const SolverState& state) {
  forget(strands_->write(state));
}

void GpuSolver::rebase(const glm::dquat& world_from_head_rotation) {
  turn_memory(strands_->rebase(world_from_head_rotation));
}

uint64_t GpuSolver::memory_bytes() const {
  return strands_->memory_bytes() + step_.size_bytes() + model_bytes();
}

}  // namespace strandcast
