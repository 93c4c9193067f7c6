#include "server/sim/strand_parameters.h"

#include <bit>
#include <cmath>

#include "common/base/hash.h"

namespace strandcast {

// Defaults of pull and drag, tried by eye on the built-in hair, whose weight the pull carries: it swings and
// bounces with every step of a walk, falls to the side of a tilted head, and does not float.
std::vector<SolverParameterInfo> shared_parameter_infos() {
  return {
      {"s_damping", 0.9, 0.0, 1.0, "",
       "share of the correction of the next vertex taken back from the velocity"},
      {"air_drag_per_s", 1.0, 0.0, 1000.0, "1/s", "rate at which strands take on the velocity of the air"},
      {"style_stiffness_per_s2", 400.0, 0.0, 1e6, "1/s^2", "pull to the groomed shape at the root; 0 = limp"},
      {"style_tip_share", 0.25, 0.0, 1.0, "",
       "part of the pull to the groomed shape that is left at the tip"},
      {"sag_free", 1.0, 0.0, 1.0, "",
       "share of the weight that the groomed shape carries: 1 = the groom as loaded is the shape at rest"},
      {"collider_friction", 0.3, 0.0, 10.0, "", "Coulomb friction of strands on colliders"},
      {"max_speed_mps", 30.0, 0.1, 1000.0, "m/s", "largest speed of a vertex relative to the head"},
  };
}

std::vector<SolverParameterInfo> uncorrected_parameter_infos() {
  std::vector<SolverParameterInfo> infos = shared_parameter_infos();
  std::erase_if(infos, [](const SolverParameterInfo& info) { return info.name == "s_damping"; });
  return infos;
}

uint32_t read_count(const SolverParameters& parameters, const std::string& name) {
  return static_cast<uint32_t>(std::lround(parameters.at(name)));
}

SolverParameterInfo thrust_share_info() {
  return {
      "thrust_share",
      1.0,
      0.0,
      1.0,
      "",
      "share of that correction kept when it thrusts: 1 = as published, jitters after fast reversals, above "
      "60 Hz for good; 0 = as hair, which buckles, but standing limp strands then sway on"};
}

SolverParameterInfo thickness_spread_info() {
  return {"thickness_spread",
          0.0,
          0.0,
          0.5,
          "",
          "strands are up to this share thinner or thicker than the mean, so that they do not move alike"};
}

double thickness_factor(const glm::vec3& root_in_head_m, double spread) {
  uint32_t hash = 0;
  for (int axis = 0; axis < 3; ++axis) hash = mix_u32(hash ^ std::bit_cast<uint32_t>(root_in_head_m[axis]));
  return 1.0 + spread * (2.0 * static_cast<double>(unit_float(hash)) - 1.0);
}

StrandParameters read_strand_parameters(const SolverParameters& parameters) {
  StrandParameters result;
  result.air_drag_per_s = parameters.at("air_drag_per_s");
  result.style_stiffness_per_s2 = parameters.at("style_stiffness_per_s2");
  result.style_tip_share = parameters.at("style_tip_share");
  result.sag_free = parameters.at("sag_free");
  result.collider_friction = parameters.at("collider_friction");
  result.max_speed_mps = parameters.at("max_speed_mps");
  const auto optional = [&parameters](const char* name, double otherwise) {
    const auto found = parameters.find(name);
    return found == parameters.end() ? otherwise : found->second;
  };
  result.s_damping = optional("s_damping", 0.0);
  result.thrust_share = optional("thrust_share", 1.0);
  result.thickness_spread = optional("thickness_spread", 0.0);
  return result;
}

}  // namespace strandcast
