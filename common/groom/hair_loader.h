// Loader for Cem Yuksel's `.hair` files: strands with their own vertex counts each. Coordinates stay in file
// units; groom_file.h applies unit and axes. Any thread.
#pragma once

#include <filesystem>

#include "common/base/result.h"
#include "common/groom/byte_view.h"
#include "common/groom/stated_groom.h"

namespace strandcast {

/// Loads a `.hair` file in file units, root vertex pinned. Thickness, transparency and colour are checked for
/// size and skipped. Errors name the file and the offending header field, strand or vertex.
Result<StatedGroom> load_hair(const std::filesystem::path& path);

/// Loads like load_hair() from bytes in memory; errors carry no file name.
Result<StatedGroom> read_hair(const ByteView& file);

}  // namespace strandcast
