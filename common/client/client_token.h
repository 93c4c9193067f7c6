// The token that a client says Hello with, from a file.
#pragma once

#include <filesystem>
#include <string>

#include "common/base/result.h"
#include "common/wire/messages.h"

namespace strandcast {

/// The token for this role from a file of at most 4 KiB: a token alone in the first line, or lines
/// "role token" as the server makes them, of which the least that serves is taken. NotFound when there is
/// none.
Result<std::string> load_token(const std::filesystem::path& path, Role role);

}  // namespace strandcast
