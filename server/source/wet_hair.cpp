#include "server/source/wet_hair.h"

#include <algorithm>
#include <utility>

#include "server/source/hair_factors.h"

namespace strandcast {

Result<SolverParameters> moving_parameters(const SolverRow& row, const SceneDesc& scene) {
  ASSIGN_OR_RETURN(SolverParameters parameters, complete_parameters(row, scene.solver.parameters));
  parameters = wet_parameters(row, std::move(parameters), static_cast<double>(scene.look.shading.wetness));
  return stiff_parameters(row, std::move(parameters), scene.hair.stiffness);
}

bool moves_otherwise(const SceneDesc& a, const SceneDesc& b) {
  return a.solver != b.solver || a.volume != b.volume || a.bend_limit != b.bend_limit ||
         a.wind.along_share != b.wind.along_share || a.look.shading.wetness != b.look.shading.wetness ||
         a.hair.stiffness != b.hair.stiffness || a.hair.friction != b.hair.friction;
}

SolverParameters wet_parameters(const SolverRow& row, SolverParameters complete, double wetness) {
  if (!(wetness > 0.0)) return complete;
  const double mass = 1.0 + (kWetMass - 1.0) * std::min(wetness, 1.0);
  for (const SolverParameterInfo& info : row.parameters) {
    const std::string& name = info.name;
    double& value = complete.at(name);
    const double dry = value;
    // The water is between the fibres: it adds mass, and neither stiffness nor anything that the wind meets.
    const bool is_per_mass = name == "air_drag_per_s" || name == "style_stiffness_per_s2" ||
                             name == "sag_free" || name == "bend_stiffness_m4_per_s2";
    const bool is_mass = name == "density_kgpm3" || name == "linear_density_kg_per_m";
    if (is_per_mass) value = dry / mass;
    if (is_mass) value = dry * mass;
    if (value != dry) value = std::clamp(value, info.minimum, info.maximum);
  }
  return complete;
}

VolumeDesc wet_volume(VolumeDesc volume, double wetness) {
  if (!(wetness > 0.0) || !volume.acts()) return volume;
  const double share = std::min(wetness, 1.0);
  volume.air.hair_density_kgpm3 *= 1.0 + share * (kWetMass - 1.0);
  if (!volume.has_contact()) return volume;
  volume.friction_per_s += share * kWetFrictionPerS;
  volume.rest_density_scale *= 1.0 + share * (kWetDensity - 1.0);
  // A style of dry hair is not one of wet hair.
  volume.target_per_s2 *= 1.0 - share;
  return volume;
}

VolumeDesc moving_volume(const SceneDesc& scene, const SolverParameters& moving) {
  VolumeDesc volume = wet_volume(scene.volume, static_cast<double>(scene.look.shading.wetness));
  volume = held_volume(std::move(volume), scene.hair.friction);
  const auto take = [&](const char* name, double& value) {
    if (const auto found = moving.find(name); found != moving.end()) value = found->second;
  };
  take("radius_m", volume.air.hair_radius_m);
  take("density_kgpm3", volume.air.hair_density_kgpm3);
  return volume;
}

}  // namespace strandcast
