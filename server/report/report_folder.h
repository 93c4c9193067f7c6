// Where a report's files go. Any thread.
#pragma once

#include <filesystem>
#include <string_view>

#include "common/base/result.h"

namespace strandcast {

/// Makes the folder and those above it; BadInput when something else has its name or it cannot be written to.
Status make_report_folder(const std::filesystem::path& folder);

/// Writes one file of a report.
Status save_text(const std::filesystem::path& path, std::string_view text);

}  // namespace strandcast
