#include "server/report/csv_file.h"

#include <fmt/format.h>

#include <cmath>

#include "common/base/check.h"

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

}  // namespace strandcast
