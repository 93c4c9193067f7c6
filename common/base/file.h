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

/// Reads a regular file of at most `limit_bytes`. NotFound, LimitExceeded or BadInput name the file.
Result<std::vector<std::byte>> load_file(const std::filesystem::path& path, uint64_t limit_bytes);

/// As load_file, as text (no encoding is assumed).
Result<std::string> load_text(const std::filesystem::path& path, uint64_t limit_bytes);

/// Writes the file through a temporary beside it, so that a reader never sees half of it.
Status save_file(const std::filesystem::path& path, std::span<const std::byte> bytes);

}  // namespace strandcast
