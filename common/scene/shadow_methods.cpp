#include "common/scene/shadow_methods.h"

#include <array>

namespace strandcast {
namespace {

constexpr std::array<RenderMethodRow, 7> kShadows{{
    {"volume", "optical depth swept through a volume of the key strands, on the CPU"},
    {"none", "all light reaches every strand"},
    {"deep_opacity", "layers that follow the first strand seen from the light (Yuksel and Keyser 2008)"},
    {"opacity_maps", "16 slices at fixed depths (Kim and Neumann 2001)"},
    {"density_rays", "rays through a volume of the drawn strands"},
    {"deep_shadow",
     "every strand on every ray, in double on the CPU: slow, the truth (Lokovic and Veach 2000)"},
    {"hybrid", "a volume fine across the light and coarse along it, with the first depth, in one draw"},
}};
constexpr std::array<RenderMethodRow, 5> kTransparencies{{
    {"hashed", "coverage decides by a fixed pattern which samples a strand takes"},
    {"lists", "the eight nearest strands of a pixel in order, the others behind them mixed"},
    {"three_depths", "the three nearest strands of a pixel in order, the others mixed (TressFX short-cut)"},
    {"weighted", "all strands of a pixel mixed with weights that fall with depth (McGuire and Bavoil 2013)"},
    {"moments", "transmittance of a pixel from four moments of depth (Muenstermann et al. 2018)"},
}};
constexpr std::array<RenderMethodRow, 3> kAntialiasings{{
    {"analytic", "a strand covers as much of a pixel as it is wide"},
    {"msaa4", "four samples per pixel, by the rasteriser"},
    {"density_samples", "four samples where little hair is behind a strand, one where much is (003, 5.2)"},
}};

Result<uint8_t> find(std::string_view kind, std::span<const RenderMethodRow> rows, std::string_view name) {
  std::string known;
  for (size_t i = 0; i < rows.size(); ++i) {
    if (rows[i].name == name) return static_cast<uint8_t>(i);
    known += std::string(known.empty() ? "" : ", ") + std::string(rows[i].name);
  }
  return make_error(ErrorCode::BadInput, "{} method {} is unknown (known: {})", kind, name, known);
}

}  // namespace

std::span<const RenderMethodRow> shadow_methods() {
  return kShadows;
}

std::span<const RenderMethodRow> transparency_methods() {
  return kTransparencies;
}

std::span<const RenderMethodRow> antialiasing_methods() {
  return kAntialiasings;
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
  return {};
}

Result<RenderMethods> find_render_methods(std::string_view shadow, std::string_view transparency,
                                          std::string_view antialiasing) {
  ASSIGN_OR_RETURN(const uint8_t shadow_row, find("shadow", kShadows, shadow));
  ASSIGN_OR_RETURN(const uint8_t transparency_row, find("transparency", kTransparencies, transparency));
  ASSIGN_OR_RETURN(const uint8_t antialiasing_row, find("antialiasing", kAntialiasings, antialiasing));
  const RenderMethods methods{static_cast<ShadowMethod>(shadow_row),
                              static_cast<TransparencyMethod>(transparency_row),
                              static_cast<AntialiasingMethod>(antialiasing_row)};
  RETURN_IF_ERROR(check_render_methods(methods));
  return methods;
}

}  // namespace strandcast
