// Wind velocity over time out of CSV files. Input is untrusted: limits are checked before anything is
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

/// Values under a header row, separated by commas, or by semicolons or tabs, and then perhaps with decimal
/// commas; columns are found by name, in any order, others are ignored, and so are empty lines and lines that
/// begin with '#'. Time: `t_s` or `time_s` (seconds) or `logger_ms` (milliseconds); the first row becomes 0.
/// Velocity, m/s: `x_mps`, `y_mps`, `z_mps` in world axes (+Y up), or `u`, `v`, `w` as meteorologists write
/// it (towards east, towards north, up), which becomes world x = u, y = w, z = -v. A log is repaired as far
/// as most of it can be used, and every kind of repair is a sentence with its count: rows that cannot be read
/// (NaN, empty, beyond kMaxWindSpeedMps) or go back in time are left out, and so are repetitions; rows that
/// share a time are spread evenly up to the next one; gaps are bridged by WindSeries::sample. BadInput and
/// LimitExceeded name file, line and column.
Result<WindSeries> load_wind_csv(const std::filesystem::path& path);

/// As load_wind_csv, from text; `place` names it in errors.
Result<WindSeries> parse_wind_csv(const std::string& text, const std::string& place);

}  // namespace strandcast
