// Folder and files of a report. Any thread.
#pragma once

#include <filesystem>
#include <string_view>

#include "common/base/result.h"

namespace strandcast {

/// Creates the folder with its parents. BadInput if something else has its name or it is not writable.
Status make_report_folder(const std::filesystem::path& folder);

/// Writes one file of a report.
Status save_text(const std::filesystem::path& path, std::string_view text);

}  // namespace strandcast
