#include "server/sim/kernel_solver.h"

#include "common/base/check.h"

namespace strandcast {
namespace {

Executor& executor_of(const SolverContext& context) {
  CHECK(context.executor != nullptr);
  return *context.executor;
}

}  // namespace

KernelSolver::KernelSolver(const SolverContext& context, const StrandParameters& parameters)
    : executor_(executor_of(context)),
      strands_(context.strands ? context.strands : std::make_shared<StrandState>(executor_)),
      parameters_(parameters),
      features_(context.features),
      volume_(context.volume),
      volume_target_(context.volume.target_per_s2 > 0.0 ? context.volume_target : nullptr),
      drag_along_share_(context.drag_along_share),
      bend_limits_(context.bend_limit),
      head_field_(context.head_field) {
  // Air drags a hair once, and where nothing blows there is nothing to keep off.
  if (!features_.has_volume) volume_.air.acts = false;
  if (volume_.air.acts) parameters_.air_drag_per_s = 0.0;
  volume_.air.has_wind = features_.has_wind;
}

Status KernelSolver::prepare_all() {
  prepare();
  // The program before stays until then: what is compiled is not compiled again.
  SceneFeatures of_model = features_;
  // Gusts pull by the model's own drag alone.
  of_model.has_turbulence = features_.has_turbulence && parameters_.air_drag_per_s > 0.0;
  ASSIGN_OR_RETURN(program_, executor_.make_program(kernel(), of_model, layout()));
  if (layout().is_mixed()) RETURN_IF_ERROR(prepare_mixed(of_model));
  if (features_.has_follicle_limit) {
    ASSIGN_OR_RETURN(follicle_limit_, FollicleLimit::make(executor_, features_, layout(), carried()));
  }
  if (features_.has_bend_limit && BendLimit::holds(layout())) {
    ASSIGN_OR_RETURN(bend_limit_, BendLimit::make(executor_, features_, layout(), carried(), bend_limits_));
  }
  if (features_.has_volume) {
    ASSIGN_OR_RETURN(volume_forces_, VolumeForces::make(executor_, features_, layout(), volume_,
                                                        carried().way, volume_target_.get()));
  }
  if (features_.has_oriented_drag) {
    ASSIGN_OR_RETURN(oriented_drag_,
                     OrientedDrag::make(executor_, features_, layout(), carried().way, drag_along_share_));
  }
  if (features_.has_body && BodyCollider::holds(layout())) {
    ASSIGN_OR_RETURN(body_collider_, BodyCollider::make(executor_, features_, *strands_, carried()));
  }
  if (features_.has_distance_field && head_field_ != nullptr && FieldCollider::holds(layout())) {
    ASSIGN_OR_RETURN(field_collider_,
                     FieldCollider::make(executor_, features_, *strands_, carried(), *head_field_));
  }
  has_gathered_ = false;
  return {};
}

Status KernelSolver::prepare_mixed(const SceneFeatures& of_model) {
  KernelDesc free_tips = kernel();
  free_tips.variant["HAS_PINNED_TAIL"] = 0;
  ASSIGN_OR_RETURN(free_tips_program_, executor_.make_program(free_tips, of_model, layout()));
  ASSIGN_OR_RETURN(mixed_tips_, MixedTips::make(executor_, features_, layout(), moving()));
  return {};
}

BoundPlanes KernelSolver::moving() const {
  BoundPlanes planes = strands_->planes();
  bind(planes);
  for (const PlaneRole role : {PlaneRole::Rest, PlaneRole::RodEdge, PlaneRole::RodStrand})
    plane_of(planes, role) = nullptr;
  return planes;
}

Status KernelSolver::load(const Groom& groom, const glm::dquat& world_from_head_rotation) {
  RETURN_IF_ERROR(strands_->load(groom, world_from_head_rotation));
  RETURN_IF_ERROR(prepare_all());
  begin();
  return {};
}

Status KernelSolver::follow() {
  RETURN_IF_ERROR(prepare_all());
  strands_->forget_model();
  begin();
  return {};
}

void KernelSolver::gather(const StepInput& input) {
  if (!volume_forces_ || has_gathered_) return;
  volume_forces_->gather(input, *strands_, carried().way);
  has_gathered_ = true;
}

void KernelSolver::substep(const StepInput& input) {
  adapt(input);
  if (input.renews_volume) gather(input);
  has_gathered_ = false;
  if (!mixed_tips_) {
    run(input, layout().has_free_tips() ? Tips::Free : Tips::Pinned, *program_);
  } else {
    const StepBlock block = make_step_block(input, parameters_, layout().counts(), strands_->head());
    for (const Tips tips : kBothTips) {
      mixed_tips_->keep(other(tips), block, moving());
      run(input, tips, tips == Tips::Free ? *free_tips_program_ : *program_);
      mixed_tips_->put_back(other(tips), block, moving());
    }
  }
  strands_->advance(input);
}

void KernelSolver::run(const StepInput& input, Tips tips, KernelProgram& program) {
  const StepBlock block = make_step_block(input, parameters_, layout().counts(tips), strands_->head());
  if (volume_forces_) volume_forces_->apply(block, *strands_, carried().way);
  if (oriented_drag_) oriented_drag_->run(block, strands_->planes(), carried().way);
  BoundPlanes planes = strands_->planes();
  bind(planes);
  program.run(block, input.colliders.size(), planes);
  // Two ends hold the others.
  if (tips == Tips::Pinned) return;
  if (bend_limit_) bend_limit_->run(block, strands_->planes(), carried());
  if (follicle_limit_ && FollicleLimit::holds(input, layout()))
    follicle_limit_->run(block, input.colliders.size(), strands_->planes(), carried());
  if (body_collider_) body_collider_->run(block, input, strands_->planes(), carried());
  // Last: whatever turned them, strands end outside of the head.
  if (field_collider_) field_collider_->run(block, strands_->planes(), carried());
}

// A strand that is written as it was read goes on as if nothing had happened; another one starts anew.
void KernelSolver::write(const SolverState& state) {
  forget(strands_->write(state));
  if (volume_forces_) volume_forces_->forget();
}

void KernelSolver::rebase(const glm::dquat& world_from_head_rotation) {
  turn_memory(strands_->rebase(world_from_head_rotation));
  if (volume_forces_) volume_forces_->forget();
}

std::shared_ptr<const StepModel> KernelSolver::step_model() {
  auto model = std::make_shared<StepModel>();
  model->kernel = kernel();
  if (find_step_kernel(model->kernel.shader_path) == nullptr) return nullptr;
  model->parameters = parameters_;
  // A target that nobody else knows is not told: strands are then predicted without their volume.
  if (features_.has_volume && volume_target_ == nullptr) model->volume = volume_;
  if (bend_limit_) model->bend = bend_angles(bend_limits_);
  if (oriented_drag_) model->drag_along_share = drag_along_share_;
  model->meets_body = body_collider_.has_value();
  if (field_collider_ && head_field_->grid().size() <= kMostToldNodes)
    model->field = std::make_shared<ToldField>(told_field(head_field_->grid(), head_field_->quad));
  model->strand_count = layout().strand_count;
  model->vertex_count = layout().vertex_count;
  model->pinned_root_count = layout().pinned_root_count;
  model->pinned_tail_count = layout().pinned_tail_count;
  model->has_tail = layout().has_tail;
  BoundPlanes planes{};
  bind(planes);
  if (const StrandPlane* edge = plane_of(planes, PlaneRole::RodEdge)) edge->read(model->rod_edge);
  if (const StrandPlane* strand = plane_of(planes, PlaneRole::RodStrand)) strand->read(model->rod_strand);
  return model;
}

uint64_t KernelSolver::memory_bytes() const {
  uint64_t bytes = strands_->memory_bytes() + model_bytes();
  if (program_) bytes += program_->size_bytes();
  if (mixed_tips_) bytes += free_tips_program_->size_bytes() + mixed_tips_->size_bytes();
  if (follicle_limit_) bytes += follicle_limit_->size_bytes();
  if (oriented_drag_) bytes += oriented_drag_->size_bytes();
  if (bend_limit_) bytes += bend_limit_->size_bytes();
  if (volume_forces_) bytes += volume_forces_->size_bytes();
  if (body_collider_) bytes += body_collider_->size_bytes();
  if (field_collider_) bytes += field_collider_->size_bytes();
  return bytes;
}

void StrandKernel::prepare() {
  if (desc_.has_offset)
    offset_ = make_plane(desc_.name + " offset", std::vector<glm::vec4>(layout().size(), glm::vec4(0.0f)));
}

KernelDesc StrandKernel::kernel() const {
  KernelDesc desc;
  desc.shader_path = desc_.shader_path;
  desc.variant = {{"HAS_PINNED_TAIL", layout().pinned_tail_count > 0 ? 1 : 0}};
  desc.constants = desc_.constants;
  desc.is_per_vertex = desc_.is_per_vertex;
  return desc;
}

void StrandKernel::bind(BoundPlanes& planes) const {
  plane_of(planes, PlaneRole::Displacement) = offset_.get();
}

void StrandKernel::forget(const std::vector<bool>& is_changed) {
  if (!desc_.has_offset) return;
  std::vector<glm::vec4> offset;
  offset_->read(offset);
  for (size_t i = 0; i < offset.size(); ++i) {
    if (is_changed[i % layout().strand_count]) offset[i] = glm::vec4(0.0f);
  }
  offset_->write(offset);
}

void StrandKernel::turn_memory(const glm::dquat& turn) {
  if (desc_.has_offset) turn_plane(*offset_, turn);
}

}  // namespace strandcast
