// CsvFile: a report's table as comma-separated values (RFC 4180), for spreadsheets and scripts. Any thread.
#pragma once

#include <string>
#include <vector>

namespace strandcast {

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

}  // namespace strandcast
