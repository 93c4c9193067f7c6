#include "common/kernels/volume/volume_law.h"

#include <algorithm>
#include <numeric>

namespace strandcast {
namespace {

constexpr uint32_t kVerticesPerElement = 4;
// Thin hair may get at least this dense, of the mean over the groom.
constexpr double kLeastShareOfMean = 0.5;
// The push's own stiffness is taken so many times into account: neighbours give way in the same step.
constexpr double kGive = 2.0;

std::vector<glm::vec4> nodes_at_rest(HairVolume& volume, const VolumeStrands& strands) {
  StrandBlocks rest(strands.strand_count, strands.vertex_count);
  pack_blocks(strands.rest_in_head_m, rest);
  VolumeInput input;
  input.position_m = rest.view();
  std::vector<glm::vec4> nodes(volume.most_nodes());
  volume.update(input, nodes);
  return nodes;
}

}  // namespace

Result<std::unique_ptr<VolumeLaw>> VolumeLaw::make(const VolumeStrands& strands, const VolumeDesc& desc,
                                                   const VolumeOptions& options,
                                                   const VolumeStrands* target) {
  VolumeOptions of_volume = options;
  of_volume.resolution = desc.resolution;
  of_volume.smoothing = desc.smoothing;
  ASSIGN_OR_RETURN(HairVolume volume, HairVolume::make(strands, of_volume));
  std::unique_ptr<VolumeLaw> law(new VolumeLaw(desc, std::move(volume)));
  double strand_count = strands.strand_count;
  if (!strands.hairs.empty()) strand_count = std::accumulate(strands.hairs.begin(), strands.hairs.end(), 0.0);
  law->hairs_per_strand_ = desc.air.hairs / std::max(strand_count, 1.0);
  if (desc.has_extras()) law->extras_ = std::make_unique<VolumeExtras>(of_volume);
  law->find_rest_density(strands);
  if (target != nullptr && desc.target_per_s2 > 0.0) RETURN_IF_ERROR(law->take_target(*target, of_volume));
  return law;
}

/// On the strands' own lattice.
Status VolumeLaw::take_target(const VolumeStrands& hair, VolumeOptions options) {
  options.cell_m = volume_.cell_m();
  ASSIGN_OR_RETURN(HairVolume volume, HairVolume::make(hair, options));
  target_ = make_target(volume.grid(), nodes_at_rest(volume, hair));
  const auto scale = static_cast<float>(volume_.length_m() / volume.length_m());
  for (float& density : target_.density_mpm3) density *= scale;
  return {};
}

KernelDesc VolumeLaw::kernel(bool has_way) const {
  KernelDesc kernel;
  kernel.shader_path = "sim/volume_forces.comp";
  const AirDesc& air = desc_.air;
  kernel.variant = {
      {"HAS_EXTRAS", extras_ ? 1 : 0}, {"HAS_AIR", air.acts ? 1 : 0}, {"HAS_WAY", has_way ? 1 : 0}};
  const double cell_m = volume_.cell_m();
  kernel.constants = {{"u_friction", desc_.friction_per_s},
                      {"u_repulsion", desc_.repulsion_per_s2 * cell_m * cell_m},
                      {"u_ahead", desc_.is_implicit() ? 1.0 : 0.0},
                      {"u_give", desc_.is_implicit() ? kGive : 0.0},
                      {"u_target", desc_.target_per_s2 * cell_m * cell_m},
                      {"u_mean_density", mean_density_mpm3_},
                      {"u_shadow", desc_.is_sheltered() ? 1.0 : 0.0}};
  if (air.acts) {
    kernel.constants["u_reynolds"] = reynolds_per_mps(air);
    kernel.constants["u_air_rate"] = air_rate_scale_per_s(air);
    kernel.constants["u_along"] = kAlongShare;
    kernel.constants["u_around"] = kAroundShare;
    kernel.constants["u_lock"] = hairs_per_strand_ * air.lock_width_m * air.hair_radius_m;
  }
  kernel.meets_colliders = false;
  return kernel;
}

/// How dense every vertex lies in the groom, and what the scene lets it be.
void VolumeLaw::find_rest_density(const VolumeStrands& strands) {
  const std::vector<glm::vec4> nodes = nodes_at_rest(volume_, strands);
  if (desc_.target_per_s2 > 0.0) target_ = make_target(volume_.grid(), nodes);
  const size_t vertices = strands.rest_in_head_m.size();
  std::vector<double> density(vertices);
  double sum = 0.0;
  size_t counted = 0;
  for (size_t i = 0; i < vertices; ++i) {
    density[i] = sample_volume(volume_.grid(), nodes, glm::dvec3(strands.rest_in_head_m[i])).density_mpm3;
    if (!strands.hairs.empty() && !(strands.hairs[i % strands.strand_count] > 0.0f)) continue;
    sum += density[i];
    ++counted;
  }
  mean_density_mpm3_ = sum / static_cast<double>(std::max<size_t>(counted, 1));
  const uint32_t rows = (strands.vertex_count + kVerticesPerElement - 1) / kVerticesPerElement;
  rest_density_.assign(size_t{rows} * strands.strand_count, glm::vec4(1.0f));
  for (size_t i = 0; i < vertices; ++i) {
    const size_t vertex = i / strands.strand_count;
    const size_t element = vertex / kVerticesPerElement * strands.strand_count + i % strands.strand_count;
    rest_density_[element][static_cast<int>(vertex % kVerticesPerElement)] = static_cast<float>(
        desc_.rest_density_scale * std::max(density[i], kLeastShareOfMean * mean_density_mpm3_));
  }
}

std::span<const glm::vec4> VolumeLaw::fill(const StepBlock& step, const VolumeState& state,
                                           std::span<glm::vec4> table) {
  VolumeInput input;
  input.position_m = state.position_m;
  input.velocity_mps = state.velocity_mps;
  if (state.is_way) input.velocity_scale = step.push.w;
  input.head_from_world =
      glm::transpose(glm::mat3(step.world_from_head[0], step.world_from_head[1], step.world_from_head[2]));
  input.head_velocity_mps = glm::vec3(step.head_velocity);
  if (desc_.is_implicit()) input.ahead_s = step.head_velocity.w;
  volume_.update(input, table.subspan(kHeader));
  const VolumeGrid& grid = volume_.grid();
  const size_t nodes = grid.size();
  table[0] = glm::vec4(grid.first, 1.0f / grid.cell_m);
  table[1] = glm::vec4(grid.nodes, 0.0f);
  if (!extras_) return table.first(kHeader + nodes);

  const glm::vec3 wind_mps(step.wind);
  const float speed_mps = glm::length(wind_mps);
  WindShadow shadow;
  shadow.width_m = static_cast<float>(
      desc_.air.acts ? hairs_per_strand_ * stopping_width_m(desc_.air, speed_mps) : desc_.wind_width_m);
  shadow.is_arriving = desc_.air.acts;
  const bool is_windy = desc_.is_sheltered() && speed_mps > 0.0f && shadow.width_m > 0.0f;
  if (is_windy) shadow.along_in_head = input.head_from_world * (wind_mps / speed_mps);
  const bool has_target = desc_.target_per_s2 > 0.0;
  extras_->update(grid, table.subspan(kHeader, nodes), has_target ? &target_ : nullptr,
                  is_windy ? &shadow : nullptr);
  pack_corners(grid, extras_->wind_share(), table.subspan(kHeader + nodes, nodes));
  if (!has_target) return table.first(kHeader + 2 * nodes);
  pack_corners(grid, extras_->excess_mpm3(), table.subspan(kHeader + 2 * nodes, nodes));
  return table.first(kHeader + 3 * nodes);
}

uint64_t VolumeLaw::size_bytes() const {
  return volume_.size_bytes() + (extras_ ? extras_->size_bytes() : 0) +
         target_.density_mpm3.size() * sizeof(float) + rest_density_.size() * sizeof(glm::vec4);
}

}  // namespace strandcast
