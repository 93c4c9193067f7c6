// Loader for TressFX `.tfx` grooms: version 4 and 3 (binary) and 2 (text), told apart by their first bytes.
// Coordinates stay in file units; groom_file.h applies unit and axes. Any thread.
#pragma once

#include <filesystem>
#include <string_view>

#include "common/base/result.h"
#include "common/groom/byte_view.h"
#include "common/groom/stated_groom.h"

namespace strandcast {

/// Loads a `.tfx` file in file units. Version 4 states which vertices are pinned. Versions 3 and 2 pin the
/// first two vertices, and the last two if their "both ends" flag is set. Version 3 may flag guides. Vertex 0
/// is always pinned. Follower settings and version 2's scale, rotation and translation are exporter notes and
/// are not applied. Notes count what is bridged or left out. Errors name the file and the offending field,
/// strand, vertex or line.
Result<StatedGroom> load_tfx(const std::filesystem::path& path, GuideUse guides = GuideUse::LeaveOut);

/// Reads the binary versions from bytes in memory; errors carry no file name.
Result<StatedGroom> read_tfx_binary(const ByteView& file, GuideUse guides = GuideUse::LeaveOut);
/// Reads the text version from text in memory; errors carry the line only.
Result<StatedGroom> read_tfx_text(std::string_view text);

}  // namespace strandcast
