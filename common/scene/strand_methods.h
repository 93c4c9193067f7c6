// Methods by which strands become what is drawn: curves through their vertices, joints of their segments, how
// much of them is drawn, what is left out because nobody sees it. Rows of tables, as in
// common/scene/render_methods.h. Pure data, any thread.
#pragma once

#include <cstdint>
#include <string_view>

#include "common/scene/render_methods.h"

namespace strandcast {

/// How a strand runs between two vertices. Shader variants of CURVE have these numbers.
enum class CurveMethod : uint8_t { Hermite, Bezier };
/// How two quads of a strand meet. Shader variants of JOINTS have these numbers.
enum class JointMethod : uint8_t { Mended, Split };
/// How much of the hair is drawn.
enum class DetailMethod : uint8_t { Adaptive, Full, Decimation, Bends, Volume };
/// What is left out of the camera's picture. Shadows are cast by all strands all the same.
enum class CullingMethod : uint8_t { None, Frustum, Occlusion };
/// How much of the hair casts shadows, with methods that draw the hair to know them.
enum class ShadowDetail : uint8_t { Same, Coarse };

const MethodTable<CurveMethod>& curve_methods();
const MethodTable<JointMethod>& joint_methods();
const MethodTable<DetailMethod>& detail_methods();
const MethodTable<CullingMethod>& culling_methods();
const MethodTable<ShadowDetail>& shadow_details();

/// Whether a field of a look (its path, as "style.clump") does anything where the look names other methods
/// than the main ones: their quads have one light, and strands without a style of their own.
bool is_drawn_by_methods(std::string_view field);

}  // namespace strandcast
