// Loader for strands in Alembic files (`.abc`, Ogawa): curves with their transforms and instances, at their
// first sample. Coordinates stay in file units; groom_file.h applies unit and axes. Any thread.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

#include "common/base/result.h"
#include "common/groom/stated_groom.h"

namespace strandcast {

/// Loads all visible curves in file units, in file order, root vertex pinned. Cubic curves are replaced by as
/// many points on the curve. Guides beside other strands go as `guides` says; notes list what was not read.
/// Unit and up axis are stated by our own exports alone. Errors name the file and the object.
Result<StatedGroom> load_abc(const std::filesystem::path& path, GuideUse guides = GuideUse::LeaveOut);

/// Loads like load_abc() from bytes in memory; errors carry no file name.
Result<StatedGroom> read_abc(std::span<const std::byte> file, GuideUse guides = GuideUse::LeaveOut);

}  // namespace strandcast
