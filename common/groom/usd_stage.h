// UsdStage: the parts of a USD file that strands need: unit, up axis, the tree of prims with transforms, and
// curves. Text and binary files fill the same stage. No composition: references are counted and not followed.
// Untrusted input. Private to the loader; one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/groom/groom_source.h"
#include "common/groom/stated_groom.h"

namespace strandcast {

inline constexpr size_t kMaxUsdPrims = 100'000;
inline constexpr size_t kMaxUsdXformOps = 32;  // of one prim
inline constexpr size_t kMaxUsdDepth = 64;     // of brackets, and of prims in each other
inline constexpr size_t kMaxUsdNameChars = 80, kMaxUsdWordChars = 40;  // that are kept of what a file says

inline constexpr std::string_view kUsdGroupName = "primvars:groom_group_name";

/// A BasisCurves prim as the file states it.
struct UsdCurves {
  std::vector<glm::vec3> points;
  std::vector<uint32_t> vertex_counts;
  std::vector<float> widths;
  std::vector<double> guides, ids, groups,
      root_uv;                         // primvars of Unreal's groom conventions; empty: there are none
  std::vector<glm::vec3> rest_points;  // of USD's proposed curve physics, as `thicknesses`
  std::vector<double> thicknesses;
  std::vector<std::string> group_names;    // likewise; one for each strand or for all, or by indices
  std::vector<double> group_name_indices;  // empty: there are none
  std::string type = "cubic";              // USD's own defaults
  std::string basis = "bezier";
  std::string wrap = "nonperiodic";
  std::optional<double> time_code;  // of the points; empty: they have none
};

struct UsdXformOp {
  std::string name;  // "xformOp:translate:pivot"
  std::vector<double> value;
};

struct UsdPrim {
  std::optional<size_t> parent;
  std::string name;
  bool is_left_out = false;  // a class, an override, not active or not visible
  std::string purpose;       // empty: that of its parent
  std::vector<UsdXformOp> op;
  std::vector<std::string> op_order;
  bool is_moving = false;       // an op has time samples
  bool is_instancer = false;    // a PointInstancer: what is in it is not drawn by itself
  uint64_t instance_count = 0;  // of one
  bool is_material = false;
  HairMaterial matter;                 // of a material
  std::optional<double> bend_modulus;  // likewise, in place of Young's modulus
  std::optional<UsdCurves> curves;
};

struct UsdStage {
  std::optional<double> meters_per_unit;
  double kilograms_per_unit = 1.0;
  std::optional<bool> is_z_up;
  std::vector<UsdPrim> prim;       // parents before what is in them
  size_t reference_count = 0;      // references, payloads, sublayers, inherited prims and variants
  size_t other_curve_count = 0;    // NurbsCurves, HermiteCurves
  std::vector<std::string> notes;  // of what could not be used
};

/// Reads a stage from text; BadInput and LimitExceeded name the line.
Result<UsdStage> read_usda_stage(std::string_view text);
/// Reads the same from the binary form; BadInput, LimitExceeded and Unsupported name the prim.
Result<UsdStage> read_usdc_stage(std::shared_ptr<GroomSource> source);

/// What both readers do with what a file states. An axis or unit that is none is left out with a note.
void set_up_axis(UsdStage& stage, std::string_view axis);
void set_meters_per_unit(UsdStage& stage, double value);
/// Returns where a word of curves belongs ("type", "basis", "wrap"), or null for any other property.
std::string* find_curves_word(UsdCurves& curves, std::string_view property);
/// Returns where a list of numbers of curves belongs (of Unreal's groom conventions), or null.
std::vector<double>* find_curves_numbers(UsdCurves& curves, std::string_view property);
/// Returns where a number of a material belongs (of USD's proposed curve physics), or null.
std::optional<double>* find_material_number(UsdPrim& prim, std::string_view property);
/// Keeps a transform's numbers; those of a time sample stay behind those without. LimitExceeded.
Status set_xform_op(UsdPrim& prim, std::string_view name, std::vector<double> value, bool is_sample);
/// Whether a prim of this type is curves of another kind.
bool is_other_curves(std::string_view type);
inline constexpr std::string_view kUsdInstancer = "PointInstancer", kUsdInstances = "protoIndices";

/// Returns whether this prim or one of its ancestors is left out or an instancer, or whether it stands for
/// another as a proxy.
bool is_left_out(const UsdStage& stage, size_t prim);
/// Returns what a prim is for: by itself, else by the nearest prim around it that says it; else "default".
std::string_view purpose_of(const UsdStage& stage, size_t prim);
/// Returns whether the transform of this prim or of one around it has time samples.
bool is_moving(const UsdStage& stage, size_t prim);

/// Returns the transform from a prim's points to the file's space. BadInput for an unknown transform op.
Result<glm::dmat4> world_from_prim(const UsdStage& stage, size_t prim);

}  // namespace strandcast
