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
                                                         const StrandPlane* way, const Groom* target) {
  std::unique_ptr<VolumeForces> forces(new VolumeForces);
  const VolumeStrands strands{layout.strand_count, layout.vertex_count, layout.rest, {}};
  if (target == nullptr) {
    ASSIGN_OR_RETURN(forces->law_, VolumeLaw::make(strands, desc, {}));
  } else {
    ASSIGN_OR_RETURN(const StrandLayout goal, make_strand_layout(*target));
    const VolumeStrands hair{goal.strand_count, goal.vertex_count, goal.rest, {}};
    ASSIGN_OR_RETURN(forces->law_, VolumeLaw::make(strands, desc, {}, &hair));
  }
  RETURN_IF_ERROR(forces->choose_scatter(executor, layout, desc, way != nullptr));
  forces->interval_ = desc.interval;
  const size_t elements = forces->law_->most_elements();
  ASSIGN_OR_RETURN(forces->table_, executor.make_table("hair volume", static_cast<uint32_t>(elements)));
  if (forces->table_->memory().empty() && !forces->device_volume_) forces->elements_.resize(elements);
  forces->rest_density_ =
      executor.make_plane("rest density", layout.strand_count, forces->law_->rest_density());
  forces->law_->forget_rest_density();
  ASSIGN_OR_RETURN(forces->program_,
                   executor.make_program(forces->law_->kernel(way != nullptr), features, layout));
  return forces;
}

/// What the scene names, or the device's where it has one.
Status VolumeForces::choose_scatter(Executor& executor, const StrandLayout& layout, const VolumeDesc& desc,
                                    bool has_way) {
  const bool is_free = desc.scatter == "auto";
  // What a software device does on the processors, the host does in a fifth of the time or less.
  const bool is_for_host = desc.has_extras() || executor.info().is_software;
  if (desc.scatter == "host" || (is_free && is_for_host)) return {};
  if (desc.has_extras())
    return make_error(
        ErrorCode::Unsupported,
        "volume.scatter: {} knows neither volume.target_per_s2 nor wind that hair keeps off (known "
        "with them: auto, host)",
        desc.scatter);
  DeviceVolumeDesc wanted;
  wanted.scatter = is_free ? "sort" : desc.scatter;
  wanted.volume = &law_->volume();
  wanted.strand_count = layout.strand_count;
  wanted.vertex_count = layout.vertex_count;
  wanted.smoothing = desc.smoothing;
  wanted.has_way = has_way;
  wanted.is_ahead = desc.is_implicit();
  Result<std::unique_ptr<DeviceVolume>> made = executor.make_volume(wanted);
  if (made) {
    device_volume_ = std::move(made).value();
    scatter_ = wanted.scatter;
    return {};
  }
  const ErrorCode code = made.error().code;
  const bool host_can = code == ErrorCode::Unsupported || code == ErrorCode::LimitExceeded;
  return is_free && host_can ? Status{} : Status(made.error());
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
  if (device_volume_) {
    device_volume_->update(step, *plane_of(planes, PlaneRole::Position), motion, *table_);
    return;
  }
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
         elements_.size() * sizeof(glm::vec4) + (device_volume_ ? device_volume_->size_bytes() : 0);
}

}  // namespace strandcast
