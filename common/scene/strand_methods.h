// Methods that turn strands into geometry: curves through vertices, joints of segments, level of detail,
// culling. Rows of tables, as in common/scene/render_methods.h. Pure data, any thread.
#pragma once

#include <cstdint>
#include <string_view>

#include "common/scene/render_methods.h"

namespace strandcast {

/// Curve of a strand between two vertices. Shader variants of CURVE have these numbers.
enum class CurveMethod : uint8_t { Hermite, Bezier };
/// How two quads of a strand join. Shader variants of JOINTS have these numbers.
enum class JointMethod : uint8_t { Mended, Split };
/// How many of the strands and segments are drawn.
enum class DetailMethod : uint8_t { Adaptive, Full, Decimation, Bends, Volume };
/// Which strands the camera's picture leaves out. All strands still cast shadows.
enum class CullingMethod : uint8_t { None, Frustum, Occlusion };
/// How much of the hair casts shadows, for shadow methods that draw the hair.
enum class ShadowDetail : uint8_t { Same, Coarse };

const MethodTable<CurveMethod>& curve_methods();
const MethodTable<JointMethod>& joint_methods();
const MethodTable<DetailMethod>& detail_methods();
const MethodTable<CullingMethod>& culling_methods();
const MethodTable<ShadowDetail>& shadow_details();

/// Returns whether a field of a look (a path such as "style.clump") has an effect with the methods that the
/// look names. Other methods than the main ones draw quads with one light, and strands without a style.
bool is_drawn_by_methods(std::string_view field);

}  // namespace strandcast
