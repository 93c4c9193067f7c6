#include "common/scene/shadow_methods.h"

#include <array>

namespace strandcast {
namespace {

constexpr std::array<MethodRow, 7> kShadows{{
    {"volume", "optical depth swept through a volume of the key strands, on the CPU"},
    {"none", "all light reaches every strand"},
    {"deep_opacity", "layers that follow the first strand seen from the light (Yuksel and Keyser 2008)"},
    {"opacity_maps", "16 slices at fixed depths (Kim and Neumann 2001)"},
    {"density_rays", "rays through a volume of the drawn strands"},
    {"deep_shadow",
     "every strand on every ray, in double on the CPU: slow, the truth (Lokovic and Veach 2000)"},
    {"hybrid", "a volume fine across the light and coarse along it, with the first depth, in one draw"},
}};
constexpr std::array<MethodRow, 5> kTransparencies{{
    {"hashed", "coverage decides by a fixed pattern which samples a strand takes"},
    {"lists", "the eight nearest strands of a pixel in order, the others behind them mixed"},
    {"three_depths", "the three nearest strands of a pixel in order, the others mixed (TressFX short-cut)"},
    {"weighted", "all strands of a pixel mixed with weights that fall with depth (McGuire and Bavoil 2013)"},
    {"moments", "transmittance of a pixel from four moments of depth (Muenstermann et al. 2018)"},
}};
constexpr std::array<MethodRow, 3> kAntialiasings{{
    {"analytic", "a strand covers as much of a pixel as it is wide"},
    {"msaa4", "four samples per pixel, by the rasteriser"},
    {"density_samples",
     "four samples where little hair is behind a strand, one where much is (Woodhouse 2017, 5.2)"},
}};

template <class Method>
Result<Method> find(const char* kind, const MethodTable<Method>& table, std::string_view name) {
  if (table.has(name)) return table.at(name);
  return make_error(ErrorCode::BadInput, "{} method {} {}", kind, name, table.refusal());
}

/// As far as names are known.
template <class Method>
bool is_method(const MethodTable<Method>& table, std::string_view name, Method method) {
  return table.has(name) && table.at(name) == method;
}

/// Names that are unknown count as the main ones.
template <class Method>
Method known(const MethodTable<Method>& table, std::string_view name) {
  return table.has(name) ? table.at(name) : Method{};
}

/// Of what reads the depth of what is opaque, in a grid of samples: empty, or why it cannot.
const char* depth_conflict(const RenderMethods& methods) {
  const bool is_msaa = methods.antialiasing == AntialiasingMethod::Msaa4;
  if (methods.culling == CullingMethod::Occlusion && is_msaa)
    return "culling occlusion does not go with antialiasing msaa4";
  if (methods.detail == DetailMethod::Volume && (methods.transparency != TransparencyMethod::Hashed ||
                                                 methods.antialiasing != AntialiasingMethod::Analytic))
    return "detail volume goes with transparency hashed and antialiasing analytic only";
  return "";
}

}  // namespace

const MethodTable<ShadowMethod>& shadow_methods() {
  static const MethodTable<ShadowMethod> table(kShadows);
  return table;
}

const MethodTable<TransparencyMethod>& transparency_methods() {
  static const MethodTable<TransparencyMethod> table(kTransparencies);
  return table;
}

const MethodTable<AntialiasingMethod>& antialiasing_methods() {
  static const MethodTable<AntialiasingMethod> table(kAntialiasings);
  return table;
}

Status check_render_methods(const RenderMethods& methods) {
  // What is blended has its coverage as opacity: samples would take it twice.
  if (methods.transparency != TransparencyMethod::Hashed &&
      methods.antialiasing != AntialiasingMethod::Analytic)
    return make_error(ErrorCode::BadInput,
                      "antialiasing {} goes with transparency {} only: {} blends what {} says of coverage",
                      kAntialiasings[static_cast<size_t>(methods.antialiasing)].name, kTransparencies[0].name,
                      kTransparencies[static_cast<size_t>(methods.transparency)].name,
                      kAntialiasings[0].name);
  if (const char* const conflict = depth_conflict(methods); *conflict != '\0')
    return make_error(ErrorCode::BadInput, "{}", conflict);
  return {};
}

Result<RenderMethods> find_render_methods(const RenderMethodsDesc& names) {
  RenderMethods methods;
  ASSIGN_OR_RETURN(methods.shadow, find("shadow", shadow_methods(), names.shadow));
  ASSIGN_OR_RETURN(methods.transparency, find("transparency", transparency_methods(), names.transparency));
  ASSIGN_OR_RETURN(methods.antialiasing, find("antialiasing", antialiasing_methods(), names.antialiasing));
  ASSIGN_OR_RETURN(methods.curve, find("curve", curve_methods(), names.curve));
  ASSIGN_OR_RETURN(methods.joints, find("joints", joint_methods(), names.joints));
  ASSIGN_OR_RETURN(methods.detail, find("detail", detail_methods(), names.detail));
  ASSIGN_OR_RETURN(methods.culling, find("culling", culling_methods(), names.culling));
  ASSIGN_OR_RETURN(methods.shadow_detail, find("shadow_detail", shadow_details(), names.shadow_detail));
  RETURN_IF_ERROR(check_render_methods(methods));
  return methods;
}

const char* method_conflict(const RenderMethodsDesc& methods) {
  const bool is_blended =
      !is_method(transparency_methods(), methods.transparency, TransparencyMethod::Hashed);
  if (is_blended && !is_method(antialiasing_methods(), methods.antialiasing, AntialiasingMethod::Analytic))
    return "antialiasing by samples goes with transparency hashed only: others blend what analytic says";
  if (is_blended && is_method(shading_places(), methods.evaluation, ShadingPlace::Fragment))
    return "evaluation per fragment goes with transparency hashed only";
  if (is_method(shading_places(), methods.evaluation, ShadingPlace::Fragment) &&
      is_method(antialiasing_methods(), methods.antialiasing, AntialiasingMethod::Msaa4))
    return "evaluation per fragment does not go with antialiasing msaa4";
  if (is_method(scattering_models(), methods.scattering, ScatteringModel::Isosurface) &&
      !is_method(shadow_methods(), methods.shadow, ShadowMethod::Volume))
    return "scattering isosurface goes with shadow volume only: its surface is that of the volume";
  RenderMethods drawn;
  drawn.transparency = known(transparency_methods(), methods.transparency);
  drawn.antialiasing = known(antialiasing_methods(), methods.antialiasing);
  drawn.detail = known(detail_methods(), methods.detail);
  drawn.culling = known(culling_methods(), methods.culling);
  return depth_conflict(drawn);
}

}  // namespace strandcast
