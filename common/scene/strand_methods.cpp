#include "common/scene/strand_methods.h"

#include <algorithm>
#include <array>
#include <string_view>

namespace strandcast {
namespace {

constexpr std::array<MethodRow, 2> kCurves{{
    {"hermite", "cubics whose tangents are those of Catmull and Rom (Woodhouse 2017, 4.3.1)"},
    {"bezier", "Bezier curves with the vertices as anchors, handles a third of a gap long (Nalu)"},
}};
constexpr std::array<MethodRow, 2> kJoints{{
    {"mended", "two segments share the corners where they meet"},
    {"split", "each quad across its own segment, with cracks at bends (Woodhouse 2017, 4.3.2)"},
}};
constexpr std::array<MethodRow, 5> kDetails{{
    {"adaptive", "fewer, wider strands and fewer segments where they are small on the screen"},
    {"full", "all strands and all segments"},
    {"decimation",
     "fewer strands, together as wide, where they are thinner than a pixel (Woodhouse 2017, 6.3)"},
    {"bends", "in each gap as many segments as a quarter of a pixel asks for"},
    {"volume", "as adaptive; from far away a volume of their density stands for strands"},
}};
constexpr std::array<MethodRow, 3> kCullings{{
    {"none", "all segments are sent to be drawn"},
    {"frustum", "segments outside the picture are left out, by indirect draws"},
    {"occlusion", "those, and segments behind the head"},
}};
constexpr std::array<MethodRow, 2> kShadowDetails{{
    {"same", "the strands that are drawn cast the shadows"},
    {"coarse", "strands chosen for the texels of the light's map cast them"},
}};

// Fields of a look that only the main method draws.
// schema begin: main only
// clang-format off
constexpr std::array<std::string_view, 15> kMainOnly{"style.clump", "style.locks", "style.spread",
                                                     "style.wave_m", "style.wave_count", "style.frizz_m",
                                                     "style.frizz_count", "style.stray_share",
                                                     "style.stray_spread", "style.length_spread",
                                                     "style.short_share", "style.tip_fade",
                                                     "shading.lock_variation", "rim_direction", "rim_color"};
// clang-format on
// schema end

}  // namespace

const MethodTable<CurveMethod>& curve_methods() {
  static const MethodTable<CurveMethod> table(kCurves);
  return table;
}

const MethodTable<JointMethod>& joint_methods() {
  static const MethodTable<JointMethod> table(kJoints);
  return table;
}

const MethodTable<DetailMethod>& detail_methods() {
  static const MethodTable<DetailMethod> table(kDetails);
  return table;
}

const MethodTable<CullingMethod>& culling_methods() {
  static const MethodTable<CullingMethod> table(kCullings);
  return table;
}

const MethodTable<ShadowDetail>& shadow_details() {
  static const MethodTable<ShadowDetail> table(kShadowDetails);
  return table;
}

bool is_drawn_by_methods(std::string_view field) {
  return std::find(kMainOnly.begin(), kMainOnly.end(), field) == kMainOnly.end();
}

}  // namespace strandcast
