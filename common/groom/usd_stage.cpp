#include "common/groom/usd_stage.h"

#include <algorithm>

#include "common/groom/text_scan.h"
#include "common/groom/usd_loader.h"

namespace strandcast {

void set_up_axis(UsdStage& stage, std::string_view axis) {
  if (axis == "Y" || axis == "Z" || axis == "y" || axis == "z")
    stage.is_z_up = axis == "Z" || axis == "z";
  else
    stage.notes.push_back(
        fmt::format("its upAxis is {}, which is not Y or Z, and is left out", quoted(axis)));
}

void set_meters_per_unit(UsdStage& stage, double value) {
  constexpr double kMostM = 1e3;
  if (value > 0.0 && value <= kMostM)
    stage.meters_per_unit = value;
  else
    stage.notes.push_back(fmt::format(
        "its metersPerUnit is {}, which is not above 0 and up to {:g}, and is left out", value, kMostM));
}

std::string* find_curves_word(UsdCurves& curves, std::string_view property) {
  return property == "type"    ? &curves.type
         : property == "basis" ? &curves.basis
         : property == "wrap"  ? &curves.wrap
                               : nullptr;
}

std::vector<double>* find_curves_numbers(UsdCurves& curves, std::string_view property) {
  return property == "primvars:groom_guide"                ? &curves.guides
         : property == "primvars:groom_id"                 ? &curves.ids
         : property == "primvars:groom_group_id"           ? &curves.groups
         : property == "primvars:groom_root_uv"            ? &curves.root_uv
         : property == "primvars:groom_group_name:indices" ? &curves.group_name_indices
         : property == kUsdThicknesses                     ? &curves.thicknesses
                                                           : nullptr;
}

std::optional<double>* find_material_number(UsdPrim& prim, std::string_view property) {
  constexpr std::string_view kPhysics = "physics:", kOlder = "omniphysics:";
  if (!prim.is_material || !(property.starts_with(kPhysics) || property.starts_with(kOlder))) return nullptr;
  const std::string_view name = property.substr(property.find(':') + 1);
  return name == "thickness" || name == "curvesThickness" ? &prim.matter.diameter
         : name == "youngsModulus"                        ? &prim.matter.young_modulus
         : name == "bendStiffness"                        ? &prim.bend_modulus
         : name == "density"                              ? &prim.matter.density
         : name == "poissonsRatio"                        ? &prim.matter.poisson_ratio
                                                          : nullptr;
}

Status set_xform_op(UsdPrim& prim, std::string_view name, std::vector<double> value, bool is_sample) {
  prim.is_moving = prim.is_moving || is_sample;
  const auto known =
      std::find_if(prim.op.begin(), prim.op.end(), [&](const UsdXformOp& op) { return op.name == name; });
  if (known != prim.op.end()) {
    if (!is_sample) known->value = std::move(value);
    return {};
  }
  if (prim.op.size() == kMaxUsdXformOps)
    return make_error(ErrorCode::LimitExceeded, "more than {} transforms of one prim", kMaxUsdXformOps);
  prim.op.push_back({std::string(name), std::move(value)});
  return {};
}

bool is_other_curves(std::string_view type) {
  return type == "NurbsCurves" || type == "HermiteCurves";
}

bool is_left_out(const UsdStage& stage, size_t prim) {
  for (std::optional<size_t> i = prim; i; i = stage.prim[*i].parent)
    if (stage.prim[*i].is_left_out || stage.prim[*i].is_instancer) return true;
  return purpose_of(stage, prim) == "proxy";
}

std::string_view purpose_of(const UsdStage& stage, size_t prim) {
  for (std::optional<size_t> i = prim; i; i = stage.prim[*i].parent)
    if (!stage.prim[*i].purpose.empty()) return stage.prim[*i].purpose;
  return "default";
}

bool is_moving(const UsdStage& stage, size_t prim) {
  for (std::optional<size_t> i = prim; i; i = stage.prim[*i].parent)
    if (stage.prim[*i].is_moving) return true;
  return false;
}

}  // namespace strandcast
