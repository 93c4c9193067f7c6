#include "common/scene/render_methods.h"

#include <array>

namespace strandcast {
namespace {

constexpr std::array<MethodRow, 5> kShading{{
    {"sadeghi", "artist's lobes R, TT and TRT with glints (Sadeghi et al. 2010)"},
    {"kajiya_kay", "a diffuse cylinder with a white and a tinted highlight (Kajiya and Kay 1989; TressFX)"},
    {"karis", "closed fits to the lobes of a smooth fibre, R a fifth too dim at 120 degrees (Karis 2016)"},
    {"chiang", "the rough fibre that conserves energy, the reference (Chiang et al. 2016)"},
    {"marschner", "the smooth fibre of Marschner et al. 2003, from tables that are made at load"},
}};
constexpr std::array<MethodRow, 4> kScattering{{
    {"volume", "what reaches a point through the density volume, raised to a power"},
    {"none", "the direct light and the surroundings alone"},
    {"isosurface", "diffuse light by the normal of the density volume (Petrovic et al. 2005)"},
    {"dual", "strands crossed scatter forward, those around scatter back (Zinke et al. 2008)"},
}};
constexpr std::array<MethodRow, 2> kPlaces{{
    {"vertex", "at the ends of drawn segments, and interpolated"},
    {"fragment", "in every sample"},
}};

}  // namespace

const MethodTable<ShadingModel>& shading_models() {
  static const MethodTable<ShadingModel> table(kShading);
  return table;
}

const MethodTable<ScatteringModel>& scattering_models() {
  static const MethodTable<ScatteringModel> table(kScattering);
  return table;
}

const MethodTable<ShadingPlace>& shading_places() {
  static const MethodTable<ShadingPlace> table(kPlaces);
  return table;
}

}  // namespace strandcast
