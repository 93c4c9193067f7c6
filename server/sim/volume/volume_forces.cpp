#include "server/sim/volume/volume_forces.h"

#include <algorithm>

#include "common/base/check.h"

namespace strandcast {
namespace {

// In front of the nodes in the table (shaders/sim/volume.glsl).
constexpr size_t kHeader = 2;
constexpr uint32_t kVerticesPerElement = 4;
// Thin hair may get at least this dense, of the mean over the groom.
constexpr double kLeastShareOfMean = 0.5;
// The push's own stiffness is taken so many times into account: neighbours give way in the same step.
constexpr double kGive = 2.0;

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
  const VolumeOptions options = {desc.resolution, desc.smoothing};
  ASSIGN_OR_RETURN(HairVolume volume, HairVolume::make(layout, {}, options));
  std::unique_ptr<VolumeForces> forces(new VolumeForces(desc, std::move(volume)));
  const bool has_extras = desc.target_per_s2 > 0.0 || desc.wind_width_m > 0.0;
  if (has_extras) forces->extras_ = std::make_unique<VolumeExtras>(options);
  const size_t elements = kHeader + (has_extras ? 2 : 1) * forces->volume_.most_nodes();
  ASSIGN_OR_RETURN(forces->table_, executor.make_table("hair volume", static_cast<uint32_t>(elements)));
  if (forces->table_->memory().empty()) forces->nodes_.resize(elements);
  forces->find_rest_density(executor, layout);

  KernelDesc kernel;
  kernel.shader_path = "sim/volume_forces.comp";
  kernel.variant = {{"HAS_EXTRAS", has_extras ? 1 : 0}, {"HAS_WAY", way != nullptr ? 1 : 0}};
  const double cell_m = forces->volume_.cell_m();
  kernel.constants = {{"u_friction", desc.friction_per_s},
                      {"u_repulsion", desc.repulsion_per_s2 * cell_m * cell_m},
                      {"u_ahead", forces->is_implicit() ? 1.0 : 0.0},
                      {"u_give", forces->is_implicit() ? kGive : 0.0},
                      {"u_target", desc.target_per_s2 * cell_m * cell_m},
                      {"u_mean_density", forces->mean_density_mpm3_},
                      {"u_shadow", desc.wind_width_m > 0.0 ? 1.0 : 0.0}};
  kernel.meets_air = true;
  kernel.meets_colliders = false;
  ASSIGN_OR_RETURN(forces->program_, executor.make_program(kernel, features, layout));
  return forces;
}

std::span<glm::vec4> VolumeForces::table_memory() {
  const std::span<glm::vec4> memory = table_->memory();
  return memory.empty() ? std::span(nodes_) : memory;
}

std::span<const glm::vec4> VolumeForces::fill_nodes(const VolumeInput& input) {
  const std::span<glm::vec4> table = table_memory();
  volume_.update(input, table.subspan(kHeader));
  const VolumeGrid& grid = volume_.grid();
  table[0] = glm::vec4(grid.first, 1.0f / grid.cell_m);
  table[1] = glm::vec4(grid.nodes, 0.0f);
  return table.subspan(kHeader, grid.size());
}

void VolumeForces::fill_extras(const VolumeInput& input, const glm::vec3& wind_mps) {
  const size_t nodes = volume_.grid().size();
  const std::span<glm::vec4> table = table_memory().subspan(kHeader);
  const float speed_mps = glm::length(wind_mps);
  WindShadow shadow;
  shadow.width_m = static_cast<float>(desc_.wind_width_m);
  const bool is_windy = speed_mps > 0.0f && shadow.width_m > 0.0f;
  if (is_windy) shadow.along_in_head = input.head_from_world * (wind_mps / speed_mps);
  extras_->update(volume_.grid(), table.first(nodes), desc_.target_per_s2 > 0.0 ? &target_ : nullptr,
                  is_windy ? &shadow : nullptr, table.subspan(nodes, nodes));
}

/// How dense every vertex lies in the groom, and what the scene lets it be.
void VolumeForces::find_rest_density(Executor& executor, const StrandLayout& layout) {
  StrandBlocks rest(layout.strand_count, layout.vertex_count);
  pack_blocks(std::span<const glm::vec4>(layout.rest), rest);
  VolumeInput input;
  input.position_m = rest.view();
  const std::span<const glm::vec4> nodes = fill_nodes(input);
  if (desc_.target_per_s2 > 0.0) target_ = make_target(volume_.grid(), nodes);
  std::vector<double> density(layout.size());
  double mean = 0.0;
  for (size_t i = 0; i < density.size(); ++i) {
    density[i] = sample_volume(volume_.grid(), nodes, glm::dvec3(layout.rest[i])).density_mpm3;
    mean += density[i] / static_cast<double>(density.size());
  }
  mean_density_mpm3_ = mean;
  const uint32_t rows = (layout.vertex_count + kVerticesPerElement - 1) / kVerticesPerElement;
  std::vector<glm::vec4> elements(size_t{rows} * layout.strand_count, glm::vec4(1.0f));
  for (uint32_t vertex = 0; vertex < layout.vertex_count; ++vertex)
    for (uint32_t strand = 0; strand < layout.strand_count; ++strand) {
      const double least = std::max(density[layout.index(vertex, strand)], kLeastShareOfMean * mean);
      const size_t element = size_t{vertex / kVerticesPerElement} * layout.strand_count + strand;
      elements[element][static_cast<int>(vertex % kVerticesPerElement)] =
          static_cast<float>(desc_.rest_density_scale * least);
    }
  rest_density_ = executor.make_plane("rest density", layout.strand_count, elements);
}

void VolumeForces::gather(const StepInput& input, StrandState& strands, const StrandPlane* way) {
  if (next_in_ > 0) {
    --next_in_;
    return;
  }
  next_in_ = desc_.interval - 1;
  const StrandLayout& layout = strands.layout();
  BoundPlanes planes = strands.planes();
  const StepBlock step = make_step_block(input, {}, layout.counts(), strands.head());
  VolumeInput volume;
  volume.position_m = blocks_of(*plane_of(planes, PlaneRole::Position), layout, position_blocks_, staging_);
  volume.velocity_mps = blocks_of(way != nullptr ? *way : *plane_of(planes, PlaneRole::Velocity), layout,
                                  velocity_blocks_, staging_);
  if (way != nullptr) volume.velocity_scale = step.push.w;
  volume.head_from_world =
      glm::transpose(glm::mat3(step.world_from_head[0], step.world_from_head[1], step.world_from_head[2]));
  volume.head_velocity_mps = glm::vec3(step.head_velocity);
  if (is_implicit()) volume.ahead_s = step.head_velocity.w;
  fill_nodes(volume);
  if (extras_) fill_extras(volume, glm::vec3(step.wind));
  if (table_->memory().empty()) table_->write(nodes_);
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
  return volume_.size_bytes() + (extras_ ? extras_->size_bytes() : 0) + table_->size_bytes() +
         rest_density_->size_bytes() + program_->size_bytes() + nodes_.size() * sizeof(glm::vec4);
}

}  // namespace strandcast
