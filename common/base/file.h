// Whole-file reading and writing with a size limit checked before anything is allocated. Any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"

namespace strandcast {

/// Reads a regular file of at most `limit_bytes`. The errors NotFound, LimitExceeded and BadInput name the
/// file.
Result<std::vector<std::byte>> load_file(const std::filesystem::path& path, uint64_t limit_bytes);

/// Reads a file like load_file() and returns it as text, without a byte order mark at its beginning.
Result<std::string> load_text(const std::filesystem::path& path, uint64_t limit_bytes);

/// Writes a temporary file beside the target and renames it, so that a reader never sees half a file.
Status save_file(const std::filesystem::path& path, std::span<const std::byte> bytes);

}  // namespace strandcast
