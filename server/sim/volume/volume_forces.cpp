#include "server/sim/volume/volume_forces.h"

namespace strandcast {
namespace {

StrandBlocksView blocks_of(const StrandPlane& plane, const StrandLayout& layout, StrandBlocks& blocks,
                           std::vector<glm::vec4>& staging) {
  if (const auto view = plane.view()) return *view;
  plane.read(staging);
  if (blocks.strand_count() != layout.strand_count || blocks.row_count() != layout.vertex_count)
    blocks = StrandBlocks(layout.strand_count, layout.vertex_count);
  pack_blocks(staging, blocks);
  return blocks.view();
}

}  // namespace

Result<std::unique_ptr<VolumeForces>> VolumeForces::make(Executor& executor, const SceneFeatures& features,
                                                         const StrandLayout& layout, const VolumeDesc& desc,
                                                         const StrandPlane* way) {
  std::unique_ptr<VolumeForces> forces(new VolumeForces);
  const VolumeStrands strands{layout.strand_count, layout.vertex_count, layout.rest, {}};
  ASSIGN_OR_RETURN(forces->law_, VolumeLaw::make(strands, desc, {}));
  forces->interval_ = desc.interval;
  const size_t elements = forces->law_->most_elements();
  ASSIGN_OR_RETURN(forces->table_, executor.make_table("hair volume", static_cast<uint32_t>(elements)));
  if (forces->table_->memory().empty()) forces->elements_.resize(elements);
  forces->rest_density_ =
      executor.make_plane("rest density", layout.strand_count, forces->law_->rest_density());
  forces->law_->forget_rest_density();
  ASSIGN_OR_RETURN(forces->program_,
                   executor.make_program(forces->law_->kernel(way != nullptr), features, layout));
  return forces;
}

void VolumeForces::gather(const StepInput& input, StrandState& strands, const StrandPlane* way) {
  if (next_in_ > 0) {
    --next_in_;
    return;
  }
  next_in_ = interval_ - 1;
  const StrandLayout& layout = strands.layout();
  BoundPlanes planes = strands.planes();
  const StrandPlane& motion = way != nullptr ? *way : *plane_of(planes, PlaneRole::Velocity);
  const StepBlock step = make_step_block(input, {}, layout.counts(), strands.head());
  const VolumeState state{
      blocks_of(*plane_of(planes, PlaneRole::Position), layout, position_blocks_, staging_),
      blocks_of(motion, layout, velocity_blocks_, staging_), way != nullptr};
  const bool is_here = !table_->memory().empty();
  law_->fill(step, state, is_here ? table_->memory() : std::span(elements_));
  if (!is_here) table_->write(elements_);
}

void VolumeForces::apply(const StepBlock& step, StrandState& strands, StrandPlane* way) {
  BoundPlanes planes = strands.planes();
  plane_of(planes, PlaneRole::Displacement) = way;
  plane_of(planes, PlaneRole::RestDensity) = rest_density_.get();
  BoundTables tables{};
  table_of(tables, TableRole::Volume) = table_.get();
  program_->run(step, 0, planes, tables);
}

uint64_t VolumeForces::size_bytes() const {
  return law_->size_bytes() + table_->size_bytes() + rest_density_->size_bytes() + program_->size_bytes() +
         elements_.size() * sizeof(glm::vec4);
}

}  // namespace strandcast
