// Reads wind velocity over time from CSV files. Input is untrusted: limits are checked before anything is
// allocated.
#pragma once

#include <filesystem>
#include <string>

#include "common/base/result.h"
#include "common/motion/motion_clip.h"

namespace strandcast {

inline constexpr uint64_t kMaxWindFileBytes = 128ull << 20;
inline constexpr uint32_t kMaxWindRows = 1'000'000;
inline constexpr uint32_t kMaxWindColumns = 256;
inline constexpr double kMaxWindSpeedMps = 150.0;

/// Loads a wind series. BadInput and LimitExceeded name file, line and column.
/// Format: values under a header row, separated by commas, or by semicolons or tabs (then decimal commas are
/// allowed). Columns are found by name in any order; other columns, empty lines and lines that begin with '#'
/// are ignored.
/// Time: `t_s` or `time_s` (seconds), or `logger_ms` (milliseconds); the first row becomes 0.
/// Velocity in m/s: `x_mps`, `y_mps`, `z_mps` in world axes (+Y up), or the meteorologists' `u`, `v`, `w` (to
/// the east, to the north, up). The latter become world x = u, y = w, z = -v.
/// Repairs: rows that cannot be read (NaN, empty, beyond kMaxWindSpeedMps), that go back in time or that
/// repeat are dropped. Rows that share a time are spread evenly up to the next one; WindSeries::sample()
/// bridges gaps. Each kind of repair is reported in a sentence with its count. A file more than a tenth of
/// whose rows cannot be used is refused.
Result<WindSeries> load_wind_csv(const std::filesystem::path& path);

/// Parses CSV text like load_wind_csv(); `place` names it in errors.
Result<WindSeries> parse_wind_csv(const std::string& text, const std::string& place);

}  // namespace strandcast
