#include "common/motion/wind_csv.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/base/file.h"
#include "common/base/mercy.h"
#include "common/base/quantile.h"
#include "common/base/units.h"
#include "common/motion/text_cursor.h"

namespace strandcast {
namespace {

constexpr double kMaxTimeS = 1e12;  // doubles still resolve a tenth of a millisecond
constexpr size_t kMaxNumberChars = 64;
constexpr double kGapSteps = 2.5;  // of the usual step: a longer one is a gap

/// How a file separates values. A file whose header has semicolons or tabs may write numbers with decimal
/// commas.
struct Dialect {
  char separator = ',';
  bool has_decimal_commas = false;
};

Dialect dialect_of(std::string_view header) {
  for (const char separator : {';', '\t'})
    if (header.find(separator) != std::string_view::npos) return {separator, true};
  return {};
}

/// One cell off the front of `line`, whose separator goes with it; nullopt after the last one.
std::optional<std::string_view> take_cell(std::string_view& line, char separator, bool& is_last) {
  if (is_last) return std::nullopt;
  const std::string_view start = trim(line);
  // Inside quotes a separator is text.
  const size_t quote = start.starts_with('"') ? start.find('"', 1) : std::string_view::npos;
  const size_t from =
      quote == std::string_view::npos ? 0 : static_cast<size_t>(start.data() + quote - line.data());
  const size_t end = line.find(separator, from);
  std::string_view cell = trim(line.substr(0, end));
  if (cell.size() >= 2 && cell.front() == '"' && cell.back() == '"')
    cell = trim(cell.substr(1, cell.size() - 2));
  is_last = end == std::string_view::npos;
  if (!is_last) line.remove_prefix(end + 1);
  return cell;
}

std::vector<std::string_view> split_cells(std::string_view line, char separator) {
  std::vector<std::string_view> cells;
  bool is_last = false;
  while (cells.size() <= kMaxWindColumns) {
    const auto cell = take_cell(line, separator, is_last);
    if (!cell) break;
    cells.push_back(*cell);
  }
  return cells;
}

/// Where the needed values stand in a row.
struct Columns {
  Dialect dialect;
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
  Columns columns;
  columns.dialect = dialect_of(line);
  const auto names = split_cells(line, columns.dialect.separator);
  if (names.size() > kMaxWindColumns)
    return cursor.fail(ErrorCode::LimitExceeded, "more than {} columns", kMaxWindColumns);
  columns.count = names.size();
  auto time = find_column(names, "t_s");
  if (!time) time = find_column(names, "time_s");
  if (!time) {
    time = find_column(names, "logger_ms");
    columns.seconds_per_unit = kSPerMs;
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

/// The number in a cell; decimal commas are counted.
Result<double> parse_cell(const TextCursor& cursor, std::string_view cell, size_t column, double limit,
                          uint64_t& decimal_commas) {
  auto value = parse_number(cell);
  const size_t comma = cell.find(',');
  if (!value && comma != std::string_view::npos && cell.size() <= kMaxNumberChars) {
    std::string with_point(cell);
    with_point[comma] = '.';
    value = parse_number(with_point);
    if (value) ++decimal_commas;
  }
  if (!value || std::abs(*value) > limit)
    return cursor.fail(ErrorCode::BadInput, "column {} is \"{}\", not a number within {:g}", column + 1,
                       shown(cell), limit);
  return *value;
}

struct Row {
  double time_s = 0.0;
  glm::dvec3 velocity_mps{0.0};
};

Result<Row> parse_row(const TextCursor& cursor, const Columns& columns, std::string_view line,
                      uint64_t& decimal_commas) {
  const auto cells = split_cells(line, columns.dialect.separator);
  if (cells.size() != columns.count)
    return cursor.fail(ErrorCode::BadInput, "the row has {} values, the header names {} columns",
                       cells.size(), columns.count);
  Row row;
  ASSIGN_OR_RETURN(const double time, parse_cell(cursor, cells[columns.time], columns.time,
                                                 kMaxTimeS / columns.seconds_per_unit, decimal_commas));
  row.time_s = time * columns.seconds_per_unit;
  for (int i = 0; i < 3; ++i) {
    const size_t column = columns.velocity[static_cast<size_t>(i)];
    ASSIGN_OR_RETURN(row.velocity_mps[i],
                     parse_cell(cursor, cells[column], column, kMaxWindSpeedMps, decimal_commas));
  }
  const glm::dvec3 v = row.velocity_mps;
  if (columns.is_meteorological) row.velocity_mps = {v.x, v.z, -v.y};
  return row;
}

/// Rows as read, without those that cannot be used, and what was done to get there.
struct Readings {
  std::vector<Row> rows;
  uint64_t decimal_commas = 0;
  uint64_t row_count = 0;  // of the file
  uint64_t backward = 0;   // their time lies before that of an earlier row
  uint64_t repeated = 0;   // the same as the row before
  uint64_t spread = 0;     // other values at the time of the row before
  uint64_t gaps = 0;
  double longest_gap_s = 0.0;
  BadItems bad;  // unreadable and backward ones

  void add(const TextCursor& cursor, const Row& row) {
    if (!rows.empty() && row.time_s < rows.back().time_s) {
      ++backward;
      bad.add(cursor.fail(ErrorCode::BadInput, "time goes back from {} s to {} s", rows.back().time_s,
                          row.time_s));
      return;
    }
    const bool is_same_time = !rows.empty() && row.time_s == rows.back().time_s;
    if (is_same_time && row.velocity_mps == rows.back().velocity_mps) {
      ++repeated;
      return;
    }
    rows.push_back(row);
  }
};

/// Rows that share a time are spread evenly up to the next time; the last ones take the usual step.
void spread_shared_times(Readings& readings, double usual_step_s) {
  std::vector<Row>& rows = readings.rows;
  for (size_t begin = 0; begin < rows.size();) {
    size_t end = begin + 1;
    while (end < rows.size() && rows[end].time_s == rows[begin].time_s) ++end;
    const auto count = static_cast<double>(end - begin);
    const double begin_s = rows[begin].time_s;
    const double step_s = end < rows.size() ? (rows[end].time_s - begin_s) / count : usual_step_s / count;
    for (size_t i = begin + 1; i < end; ++i) {
      rows[i].time_s = begin_s + static_cast<double>(i - begin) * step_s;
      ++readings.spread;
    }
    begin = end;
  }
}

/// The median of the steps that are no repetition, s.
double usual_step_s(const std::vector<Row>& rows) {
  std::vector<double> steps_s;
  for (size_t i = 1; i < rows.size(); ++i)
    if (rows[i].time_s > rows[i - 1].time_s) steps_s.push_back(rows[i].time_s - rows[i - 1].time_s);
  return steps_s.empty() ? 1.0 : median(std::move(steps_s));
}

std::vector<std::string> repairs_of(const Readings& readings, const Dialect& dialect) {
  std::vector<std::string> repairs;
  const auto say = [&](uint64_t count, const std::string& what) {
    if (count > 0) repairs.push_back(fmt::format("{} {}", count, what));
  };
  if (dialect.separator != ',')
    repairs.push_back(
        fmt::format("values are separated by {}", dialect.separator == ';' ? "semicolons" : "tabs"));
  if (readings.decimal_commas > 0)
    repairs.push_back(
        counted(readings.decimal_commas, "number has a decimal comma", "numbers have a decimal comma"));
  if (readings.bad.count() > 0)
    repairs.push_back(readings.bad.sentence(
        readings.row_count, "rows",
        fmt::format("and are left out ({} go back in time)", readings.backward).c_str()));
  say(readings.repeated, "rows left out because they repeat the one before");
  say(readings.spread, "rows with the time of the one before, spread evenly up to the next time");
  if (readings.gaps > 0)
    repairs.push_back(
        fmt::format("{} gaps, the longest of {:.3g} s: the wind goes evenly from one end to the other",
                    readings.gaps, readings.longest_gap_s));
  return repairs;
}

void count_gaps(Readings& readings, double usual_s) {
  for (size_t i = 1; i < readings.rows.size(); ++i) {
    const double step_s = readings.rows[i].time_s - readings.rows[i - 1].time_s;
    if (step_s <= kGapSteps * usual_s) continue;
    ++readings.gaps;
    readings.longest_gap_s = std::max(readings.longest_gap_s, step_s);
  }
}

}  // namespace

Result<WindSeries> parse_wind_csv(const std::string& text, const std::string& place) {
  TextCursor cursor(text, place);
  std::optional<Columns> columns;
  Readings readings;
  while (const auto line = cursor.next_line()) {
    if (line->starts_with('#')) continue;
    if (!columns) {
      ASSIGN_OR_RETURN(columns, parse_header(cursor, *line));
      continue;
    }
    if (readings.rows.size() >= kMaxWindRows)
      return cursor.fail(ErrorCode::LimitExceeded, "more than {} rows", kMaxWindRows);
    const auto row = parse_row(cursor, *columns, *line, readings.decimal_commas);
    ++readings.row_count;
    if (row)
      readings.add(cursor, *row);
    else
      readings.bad.add(row.error());
  }
  if (!columns) return cursor.fail(ErrorCode::BadInput, "the file has no header row");
  RETURN_IF_ERROR(readings.bad.judge(readings.row_count, "rows"));
  if (readings.rows.empty()) return cursor.fail(ErrorCode::BadInput, "the file has a header but no rows");
  const double usual_s = usual_step_s(readings.rows);
  count_gaps(readings, usual_s);
  spread_shared_times(readings, usual_s);

  WindSeries series;
  series.repairs = repairs_of(readings, columns->dialect);
  const double first_s = readings.rows.front().time_s;
  for (const Row& row : readings.rows) {
    const double time_s = row.time_s - first_s;
    // Times that are too near for their size cannot be told apart.
    if (!series.time_s.empty() && !(time_s > series.time_s.back())) continue;
    series.time_s.push_back(time_s);
    series.velocity_mps.push_back(row.velocity_mps);
  }
  return series;
}

Result<WindSeries> load_wind_csv(const std::filesystem::path& path) {
  ASSIGN_OR_RETURN(const std::string text, load_text(path, kMaxWindFileBytes));
  return parse_wind_csv(text, path.string());
}

}  // namespace strandcast
