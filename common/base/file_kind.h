// What a file is by its first bytes, whatever its name, for errors that say what to do. Any thread.
#pragma once

#include <filesystem>
#include <string>

namespace strandcast {

/// Returns what a file with another extension than its bytes ask for is, and what to do with it: "it looks
/// like Alembic: call it .abc". Returns "" for what is not known, and where the extension fits.
std::string likely_kind(const std::filesystem::path& path);

}  // namespace strandcast
