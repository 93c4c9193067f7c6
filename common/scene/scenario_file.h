// Scenario files: protobuf text against proto/strandcast/v1/scenario.proto. Unknown fields, wrong types and
// values out of range are errors with file, line and column.
#pragma once

#include "common/base/result.h"
#include "common/scene/scenario.h"

namespace strandcast {

inline constexpr uint64_t kMaxScenarioFileBytes = 256u << 10;
inline constexpr size_t kMaxScenarioActions = 1'000;
inline constexpr uint32_t kMaxScenarioRepeats = 10;
inline constexpr double kMaxScenarioS = 3'600.0;
inline constexpr uint32_t kMaxScenarioDatagramBytes = 65'507;  // of UDP over IPv4

/// Loads a scenario; relative paths in it start at the file's folder.
Result<Scenario> load_scenario(const std::filesystem::path& path);

/// Parses a scenario's text; `place` names it in errors, and relative paths start at `folder`.
Result<Scenario> parse_scenario(const std::string& text, const std::string& place,
                                const std::filesystem::path& folder);

}  // namespace strandcast
