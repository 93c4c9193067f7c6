// Files of a report: its folder, and tables as comma-separated values. Any thread.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"

namespace strandcast {

/// A table as comma-separated values (RFC 4180), for spreadsheets and scripts.
class CsvFile {
 public:
  explicit CsvFile(std::vector<std::string> columns);

  /// Adds a row with one cell per column.
  void add_row(const std::vector<std::string>& cells);
  /// Returns header and rows; a cell with a comma, a quote or a line break is quoted.
  const std::string& text() const { return text_; }

 private:
  void append(const std::vector<std::string>& cells);

  size_t column_count_;
  std::string text_;
};

/// Formats a number with six significant digits; empty for NaN (not measured), "inf" for unbounded growth.
std::string csv_number(double value);

/// Creates the folder with its parents and tries to write in it. BadInput if something else has its name; the
/// error of writing if no file may be written.
Status make_report_folder(const std::filesystem::path& folder);

/// Writes one file of a report.
Status save_text(const std::filesystem::path& path, std::string_view text);

}  // namespace strandcast
