// Loader for strands in USD text files (`.usda`): the BasisCurves of a stage that are there without following
// references, with their transforms. Coordinates stay in file units; groom_file.h applies unit and axes. Any
// thread.
#pragma once

#include <filesystem>
#include <string_view>

#include "common/base/result.h"
#include "common/groom/stated_groom.h"

namespace strandcast {

/// Loads all BasisCurves in file units, one behind the other, root vertex pinned. Points without a time go
/// before time samples, of which the first counts. Control points of cubic curves are replaced by as many
/// points on the curve. What is inactive, invisible, a class or an override is left out; notes say what was
/// not read. Errors name the file and the line, or prim and curve.
Result<StatedGroom> load_usda(const std::filesystem::path& path);

/// As load_usda, from text in memory; errors carry no file name.
Result<StatedGroom> read_usda(std::string_view text);

}  // namespace strandcast
