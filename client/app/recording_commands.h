// The sub-commands of strandcast-ctl that work on recordings, without a server. Each prints what it found and
// returns the exit code: 0 all is well, 1 it is not, 2 there is no recording to look at.
#pragma once

#include <filesystem>

namespace strandcast {

/// What a recording holds, for a person.
int run_recording_info(const std::filesystem::path& path);
/// CRCs, order and strands; 1 for what is damaged or was cut off.
int run_recording_check(const std::filesystem::path& path);
/// A whole file of one that is not; `to` empty: beside it, with ".recovered.mcap" for its ending.
int run_recover(const std::filesystem::path& from, std::filesystem::path to);
/// The first step that differs, and by how much; 1 where one does.
int run_compare(const std::filesystem::path& a, const std::filesystem::path& b);

}  // namespace strandcast
