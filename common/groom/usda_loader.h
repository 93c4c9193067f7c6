// Loader for strands in USD text files (`.usda`): BasisCurves with their transforms, without composition
// (references are not followed). Coordinates stay in file units; groom_file.h applies unit and axes. Any
// thread.
#pragma once

#include <filesystem>
#include <string_view>

#include "common/base/result.h"
#include "common/groom/stated_groom.h"

namespace strandcast {

/// Loads all BasisCurves in file units, in file order, root vertex pinned. Points without a time take
/// precedence over time samples, of which the first is used. Cubic curves are replaced by as many points on
/// the curve. Inactive and invisible prims, classes and overrides are omitted; notes list what was not read.
/// Errors name the file and the line, or the prim and curve.
Result<StatedGroom> load_usda(const std::filesystem::path& path);

/// Loads like load_usda() from text in memory; errors carry no file name.
Result<StatedGroom> read_usda(std::string_view text);

}  // namespace strandcast
