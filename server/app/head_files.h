// What the files of a server's heads are called: of several heads each writes its own recording and its own
// trace, beside those of the first. Pure functions, any thread.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace strandcast {

/// What stands behind the name of a file of each head, given their names: nothing for the first, "-ben" for
/// one called ben. Letters, digits and + - _ alone, whatever a head is called, and each its own, also where a
/// disk takes large letters for small ones.
std::vector<std::string> head_file_endings(const std::vector<std::string>& heads);

/// "takes/run.mcap" with "-ben": "takes/run-ben.mcap".
std::filesystem::path with_file_ending(const std::filesystem::path& path, const std::string& ending);

}  // namespace strandcast
