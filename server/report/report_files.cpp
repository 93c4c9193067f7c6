#include "server/report/report_files.h"

#include <fmt/format.h>

#include <cmath>
#include <span>
#include <system_error>

#include "common/base/check.h"
#include "common/base/file.h"

namespace strandcast {

CsvFile::CsvFile(std::vector<std::string> columns) : column_count_(columns.size()) {
  append(columns);
}

void CsvFile::add_row(const std::vector<std::string>& cells) {
  CHECK(cells.size() == column_count_);
  append(cells);
}

void CsvFile::append(const std::vector<std::string>& cells) {
  for (size_t i = 0; i < cells.size(); ++i) {
    if (i > 0) text_ += ',';
    if (cells[i].find_first_of(",\"\r\n") == std::string::npos) {
      text_ += cells[i];
      continue;
    }
    text_ += '"';
    for (const char c : cells[i]) text_ += c == '"' ? "\"\"" : std::string(1, c);
    text_ += '"';
  }
  text_ += '\n';
}

std::string csv_number(double value) {
  if (std::isnan(value)) return "";
  if (std::isinf(value)) return value > 0.0 ? "inf" : "-inf";
  return fmt::format("{:.6g}", value);
}

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
