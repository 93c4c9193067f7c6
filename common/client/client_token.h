// Reads the token of a client's Hello from a file.
#pragma once

#include <filesystem>
#include <string>

#include "common/base/result.h"
#include "common/wire/messages.h"

namespace strandcast {

/// Returns the token for this role from a file of at most 4 KiB: a single token in the first line, or lines
/// "role token" as the server writes them. Of these it takes the one with the least rights that suffices.
/// NotFound if there is none.
Result<std::string> load_token(const std::filesystem::path& path, Role role);

}  // namespace strandcast
