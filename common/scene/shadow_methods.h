// Methods by which hair shadows itself, is seen through and has smooth edges, as rows of tables: a renderer
// is given one of each kind. Pure data, any thread. What draws them is in common/render/shadow and
// common/render/transparency.
#pragma once

#include <cstdint>
#include <string_view>

#include "common/base/result.h"
#include "common/scene/render_methods.h"
#include "common/scene/strand_methods.h"

namespace strandcast {

/// How much of the light reaches a strand through the others. Shader variants of SHADOW have these numbers.
enum class ShadowMethod : uint8_t { Volume, None, DeepOpacity, OpacityMaps, DensityRays, DeepShadow, Hybrid };
/// How strands that cover a part of a pixel are put in front of one another.
enum class TransparencyMethod : uint8_t { Hashed, Lists, ThreeDepths, Weighted, Moments };
/// How the edge of a strand becomes smooth.
enum class AntialiasingMethod : uint8_t { Analytic, Msaa4, DensitySamples };

const MethodTable<ShadowMethod>& shadow_methods();
const MethodTable<TransparencyMethod>& transparency_methods();
const MethodTable<AntialiasingMethod>& antialiasing_methods();

/// One of each kind.
struct RenderMethods {
  ShadowMethod shadow = ShadowMethod::Volume;
  TransparencyMethod transparency = TransparencyMethod::Hashed;
  AntialiasingMethod antialiasing = AntialiasingMethod::Analytic;
  CurveMethod curve = CurveMethod::Hermite;
  JointMethod joints = JointMethod::Mended;
  DetailMethod detail = DetailMethod::Adaptive;
  CullingMethod culling = CullingMethod::None;
  ShadowDetail shadow_detail = ShadowDetail::Same;

  bool operator==(const RenderMethods&) const = default;
};

/// BadInput for kinds that do not go together.
Status check_render_methods(const RenderMethods& methods);

/// By the names of their rows. BadInput names an unknown one with all that there are, and kinds that do not
/// go together.
Result<RenderMethods> find_render_methods(const RenderMethodsDesc& names);

/// Empty where the methods of a look go together, else why they do not. Unknown names count as the main ones.
const char* method_conflict(const RenderMethodsDesc& methods);

}  // namespace strandcast
