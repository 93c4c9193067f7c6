#include "server/source/hair_factors.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

namespace strandcast {
namespace {

// Of all rows. What stretches is no stiffness of a style: lengths stay.
constexpr std::array<std::string_view, 7> kStiffnesses{
    "young_modulus_pa",          "style_margin",   "style_stiffness_per_s2",    "bend_stiffness_m4_per_s2",
    "bend_stiffness_nm_per_rad", "bend_stiffness", "altitude_stiffness_n_per_m"};
constexpr std::string_view kCompliance = "bend_compliance_m_per_n";

}  // namespace

SolverParameters stiff_parameters(const SolverRow& row, SolverParameters complete, double times) {
  if (times == 1.0) return complete;
  for (const SolverParameterInfo& info : row.parameters) {
    double& value = complete.at(info.name);
    const bool is_stiffness =
        std::find(kStiffnesses.begin(), kStiffnesses.end(), info.name) != kStiffnesses.end();
    if (is_stiffness) value = std::clamp(value * times, info.minimum, info.maximum);
    if (info.name == kCompliance) value = std::clamp(value / times, info.minimum, info.maximum);
  }
  return complete;
}

VolumeDesc held_volume(VolumeDesc volume, double times) {
  volume.friction_per_s *= times;
  return volume;
}

}  // namespace strandcast
