#include "common/motion/wind_csv.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/file.h"
#include "common/motion/text_cursor.h"

namespace strandcast {
namespace {

constexpr double kMaxTimeS = 1e12;  // doubles still resolve a tenth of a millisecond
constexpr double kSecondsPerMillisecond = 1e-3;

std::vector<std::string_view> split_cells(std::string_view line) {
  std::vector<std::string_view> cells;
  while (cells.size() <= kMaxWindColumns) {
    const size_t comma = line.find(',');
    std::string_view cell = trim(line.substr(0, comma));
    if (cell.size() >= 2 && cell.front() == '"' && cell.back() == '"')
      cell = trim(cell.substr(1, cell.size() - 2));
    cells.push_back(cell);
    if (comma == std::string_view::npos) break;
    line.remove_prefix(comma + 1);
  }
  return cells;
}

/// Where the needed values stand in a row.
struct Columns {
  size_t count = 0;
  size_t time = 0;
  std::array<size_t, 3> velocity{};
  bool is_meteorological = false;
  double seconds_per_unit = 1.0;
};

std::optional<size_t> find_column(const std::vector<std::string_view>& names, std::string_view wanted) {
  for (size_t i = 0; i < names.size(); ++i)
    if (equals_ignoring_case(names[i], wanted)) return i;
  return std::nullopt;
}

std::optional<std::array<size_t, 3>> find_columns(const std::vector<std::string_view>& names,
                                                  const std::array<const char*, 3>& wanted) {
  std::array<size_t, 3> found{};
  for (size_t i = 0; i < 3; ++i) {
    const auto column = find_column(names, wanted[i]);
    if (!column) return std::nullopt;
    found[i] = *column;
  }
  return found;
}

Result<Columns> parse_header(const TextCursor& cursor, std::string_view line) {
  const auto names = split_cells(line);
  if (names.size() > kMaxWindColumns)
    return cursor.fail(ErrorCode::LimitExceeded, "more than {} columns", kMaxWindColumns);
  Columns columns;
  columns.count = names.size();
  auto time = find_column(names, "t_s");
  if (!time) time = find_column(names, "time_s");
  if (!time) {
    time = find_column(names, "logger_ms");
    columns.seconds_per_unit = kSecondsPerMillisecond;
  }
  if (!time)
    return cursor.fail(ErrorCode::BadInput,
                       "the header has no time column (known: t_s, time_s, logger_ms): \"{}\"", shown(line));
  columns.time = *time;
  auto velocity = find_columns(names, {"x_mps", "y_mps", "z_mps"});
  if (!velocity) {
    velocity = find_columns(names, {"u", "v", "w"});
    columns.is_meteorological = true;
  }
  if (!velocity)
    return cursor.fail(ErrorCode::BadInput,
                       "the header has no velocity columns (known: x_mps, y_mps, z_mps or u, v, w): \"{}\"",
                       shown(line));
  columns.velocity = *velocity;
  return columns;
}

Result<double> parse_cell(const TextCursor& cursor, std::string_view cell, size_t column, double limit) {
  const auto value = parse_number(cell);
  if (!value || std::abs(*value) > limit)
    return cursor.fail(ErrorCode::BadInput, "column {} is \"{}\", not a number within {:g}", column + 1,
                       shown(cell), limit);
  return *value;
}

struct Row {
  double time_s = 0.0;
  glm::dvec3 velocity_mps{0.0};
};

Result<Row> parse_row(const TextCursor& cursor, const Columns& columns, std::string_view line) {
  const auto cells = split_cells(line);
  if (cells.size() != columns.count)
    return cursor.fail(ErrorCode::BadInput, "the row has {} values, the header names {} columns",
                       cells.size(), columns.count);
  Row row;
  ASSIGN_OR_RETURN(const double time, parse_cell(cursor, cells[columns.time], columns.time,
                                                 kMaxTimeS / columns.seconds_per_unit));
  row.time_s = time * columns.seconds_per_unit;
  for (int i = 0; i < 3; ++i) {
    const size_t column = columns.velocity[static_cast<size_t>(i)];
    ASSIGN_OR_RETURN(row.velocity_mps[i], parse_cell(cursor, cells[column], column, kMaxWindSpeedMps));
  }
  const glm::dvec3 v = row.velocity_mps;
  if (columns.is_meteorological) row.velocity_mps = {v.x, v.z, -v.y};
  return row;
}

}  // namespace

Result<WindSeries> parse_wind_csv(const std::string& text, const std::string& place) {
  TextCursor cursor(text, place);
  std::optional<Columns> columns;
  WindSeries series;
  double first_s = 0.0;
  while (const auto line = cursor.next_line()) {
    if (line->starts_with('#')) continue;
    if (!columns) {
      ASSIGN_OR_RETURN(columns, parse_header(cursor, *line));
      continue;
    }
    if (series.time_s.size() >= kMaxWindRows)
      return cursor.fail(ErrorCode::LimitExceeded, "more than {} rows", kMaxWindRows);
    ASSIGN_OR_RETURN(const Row row, parse_row(cursor, *columns, *line));
    if (series.time_s.empty()) first_s = row.time_s;
    const double time_s = row.time_s - first_s;
    if (!series.time_s.empty() && !(time_s > series.time_s.back()))
      return cursor.fail(ErrorCode::BadInput, "time goes from {} s to {} s, it must increase",
                         series.time_s.back() + first_s, row.time_s);
    series.time_s.push_back(time_s);
    series.velocity_mps.push_back(row.velocity_mps);
  }
  if (!columns) return cursor.fail(ErrorCode::BadInput, "the file has no header row");
  if (series.time_s.empty()) return cursor.fail(ErrorCode::BadInput, "the file has a header but no rows");
  return series;
}

Result<WindSeries> load_wind_csv(const std::filesystem::path& path) {
  ASSIGN_OR_RETURN(const std::string text, load_text(path, kMaxWindFileBytes));
  return parse_wind_csv(text, path.string());
}

}  // namespace strandcast
