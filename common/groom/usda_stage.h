// UsdaStage: the parts of a USD text file that strands need: unit, up axis, the tree of prims with
// transforms, and curves. No composition: references are counted and not followed. Untrusted input. Private
// to the loader; one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"

namespace strandcast {

inline constexpr size_t kMaxUsdaPrims = 100'000;
inline constexpr size_t kMaxUsdaXformOps = 32;  // of one prim

/// A BasisCurves prim as the file states it.
struct UsdaCurves {
  std::vector<glm::vec3> points;
  std::vector<uint32_t> vertex_counts;
  std::vector<float> widths;
  std::vector<double> ids, groups, root_uv;  // primvars of Unreal's groom conventions; empty: there are none
  std::string type = "cubic";                // USD's own defaults
  std::string basis = "bezier";
  std::string wrap = "nonperiodic";
  std::optional<double> time_code;  // of the points; empty: they have none
};

struct UsdaXformOp {
  std::string name;  // "xformOp:translate:pivot"
  std::vector<double> value;
};

struct UsdaPrim {
  std::optional<size_t> parent;
  std::string name;
  bool is_left_out = false;  // a class, an override, not active or not visible
  std::vector<UsdaXformOp> op;
  std::vector<std::string> op_order;
  std::optional<UsdaCurves> curves;
};

struct UsdaStage {
  std::optional<double> meters_per_unit;
  std::optional<bool> is_z_up;
  std::vector<UsdaPrim> prim;    // parents before what is in them
  size_t reference_count = 0;    // references, payloads, sublayers, inherited prims and variants
  size_t other_curve_count = 0;  // NurbsCurves, HermiteCurves
};

/// Reads a stage; BadInput and LimitExceeded name the line.
Result<UsdaStage> read_usda_stage(std::string_view text);

/// Returns whether this prim or one of its ancestors is left out.
bool is_left_out(const UsdaStage& stage, size_t prim);

/// Returns the transform from a prim's points to the file's space. BadInput for an unknown transform op.
Result<glm::dmat4> world_from_prim(const UsdaStage& stage, size_t prim);

}  // namespace strandcast
