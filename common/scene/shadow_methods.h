// Methods of self-shadowing, transparency and antialiasing of hair, as rows of tables; a renderer uses one of
// each kind. Pure data, any thread. They are implemented in common/render/shadow and
// common/render/transparency.
#pragma once

#include <cstdint>
#include <string_view>

#include "common/base/result.h"
#include "common/scene/render_methods.h"
#include "common/scene/strand_methods.h"

namespace strandcast {

/// How the light that reaches a strand through other strands is computed. Shader variants of SHADOW have
/// these numbers.
enum class ShadowMethod : uint8_t { Volume, None, DeepOpacity, OpacityMaps, DensityRays, DeepShadow, Hybrid };
/// How strands that cover part of a pixel are ordered and blended.
enum class TransparencyMethod : uint8_t { Hashed, Lists, ThreeDepths, Weighted, Moments };
/// How edges of strands are antialiased.
enum class AntialiasingMethod : uint8_t { Analytic, Msaa4, DensitySamples };

const MethodTable<ShadowMethod>& shadow_methods();
const MethodTable<TransparencyMethod>& transparency_methods();
const MethodTable<AntialiasingMethod>& antialiasing_methods();

/// One method of each kind.
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

/// Returns BadInput for methods that cannot be combined.
Status check_render_methods(const RenderMethods& methods);

/// Finds methods by the names of their rows. BadInput for an unknown name (with all known ones) and for
/// methods that cannot be combined.
Result<RenderMethods> find_render_methods(const RenderMethodsDesc& names);

/// Returns why the methods of a look cannot be combined; empty if they can. Unknown names count as the main
/// methods.
const char* method_conflict(const RenderMethodsDesc& methods);

}  // namespace strandcast
