// Names of the files of a server's heads: each of several heads writes its own recording and trace beside
// those of the first. Pure functions, any thread.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace strandcast {

/// Returns the suffix of each head's files, given the heads' names: empty for the first, "-ben" for one named
/// ben. Suffixes contain only letters, digits and + - _. They are distinct even on file systems that ignore
/// case.
std::vector<std::string> head_file_endings(const std::vector<std::string>& heads);

/// Inserts a suffix before the extension: "takes/run.mcap" with "-ben" gives "takes/run-ben.mcap".
std::filesystem::path with_file_ending(const std::filesystem::path& path, const std::string& ending);

}  // namespace strandcast
