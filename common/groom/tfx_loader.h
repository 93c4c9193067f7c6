// Loader for TressFX `.tfx` grooms: version 4 and 3 (binary) and 2 (text), told apart by their first bytes.
// Coordinates stay in file units; groom_file.h applies unit and axes. Any thread.
#pragma once

#include <filesystem>
#include <string_view>

#include "common/base/result.h"
#include "common/groom/byte_view.h"
#include "common/groom/groom.h"

namespace strandcast {

/// Loads a `.tfx` file in file units. Version 4 says which vertices are pinned; versions 3 and 2 pin the
/// first two, and the last two when their "both ends" flag is set. Vertex 0 is pinned always. Follower
/// settings and the scale, rotation and translation of version 2 are notes of the exporter about the
/// coordinates and are not applied. Errors name the file and the offending field, strand, vertex or line.
Result<Groom> load_tfx(const std::filesystem::path& path);

/// The binary versions from bytes in memory; errors carry no file name.
Result<Groom> read_tfx_binary(const ByteView& file);
/// The text version from text in memory; errors carry the line only.
Result<Groom> read_tfx_text(std::string_view text);

}  // namespace strandcast
