// Sub-commands of strandcast-ctl that examine recordings without a server. Each prints its findings and
// returns the exit code: 0 = no fault, 1 = a fault was found, 2 = no recording.
#pragma once

#include <filesystem>

namespace strandcast {

/// Describes the content of a recording for a person.
int run_recording_info(const std::filesystem::path& path);
/// Checks CRCs, order and strands; returns 1 for a damaged or truncated recording.
int run_recording_check(const std::filesystem::path& path);
/// Writes a complete file from a truncated one. If `to` is empty, it is placed beside the original with the
/// ending ".recovered.mcap".
int run_recover(const std::filesystem::path& from, std::filesystem::path to);
/// Finds the first step in which two recordings differ, and by how much; returns 1 if there is one.
int run_compare(const std::filesystem::path& a, const std::filesystem::path& b);

}  // namespace strandcast
