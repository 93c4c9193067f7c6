// Folder and files of a report. Any thread.
#pragma once

#include <filesystem>
#include <string_view>

#include "common/base/result.h"

namespace strandcast {

/// Creates the folder with its parents and tries to write in it. BadInput if something else has its name; the
/// error of writing if no file may be written.
Status make_report_folder(const std::filesystem::path& folder);

/// Writes one file of a report.
Status save_text(const std::filesystem::path& path, std::string_view text);

}  // namespace strandcast
