#include "server/report/report_folder.h"

#include <span>
#include <system_error>

#include "common/base/file.h"

namespace strandcast {

Status make_report_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error || !std::filesystem::is_directory(folder, error))
    return at(folder.string(), make_error(ErrorCode::BadInput, "cannot be made as a folder"));
  const std::filesystem::path probe = folder / "report.probe";
  RETURN_IF_ERROR(save_text(probe, "may a file be written here?\n"));
  std::filesystem::remove(probe, error);
  return {};
}

Status save_text(const std::filesystem::path& path, std::string_view text) {
  return save_file(path, std::as_bytes(std::span(text.data(), text.size())));
}

}  // namespace strandcast
