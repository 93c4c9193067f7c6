// Loader for strands in USD files: text (`.usda`), binary (`.usdc`), either of them (`.usd`) or in a package
// (`.usdz`), told apart by their first bytes. BasisCurves with their transforms, without composition
// (references are not followed). Coordinates stay in file units; groom_file.h applies unit and axes. Any
// thread.
#pragma once

#include <filesystem>
#include <string_view>

#include "common/base/result.h"
#include "common/groom/stated_groom.h"

namespace strandcast {

/// Properties of curves in the proposal for deformable bodies of USD's physics.
inline constexpr std::string_view kUsdRestPoints = "physics:restShapePoints";
inline constexpr std::string_view kUsdThicknesses = "physics:thicknesses";

/// Whether this is ".usd", ".usda", ".usdc" or ".usdz".
bool is_usd_extension(std::string_view extension);

/// Loads all BasisCurves in file units, in file order, root vertex pinned. Points without a time take
/// precedence over time samples, of which the first is used. Guides beside other strands go as `guides` says.
/// Cubic curves are replaced by as many points on the curve. Inactive and invisible prims, classes and
/// overrides are omitted; notes list what was not read. Errors name the file and the line, or the prim and
/// curve.
Result<StatedGroom> load_usd(const std::filesystem::path& path, GuideUse guides = GuideUse::LeaveOut);

/// Loads like load_usd() from a file in memory; errors carry no file name.
Result<StatedGroom> read_usd(std::string_view file, GuideUse guides = GuideUse::LeaveOut);

}  // namespace strandcast
