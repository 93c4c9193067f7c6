// What runs the solvers of a report.
#pragma once

#include <memory>
#include <vector>

#include "server/sim/executor/executor.h"

namespace strandcast {

/// As a GL device: none, but the double-precision references.
inline constexpr const char* kNoDevice = "none";

/// As a simulation device: every executor, where a report compares them.
inline constexpr const char* kAllDevices = "all";

/// nullptr for kNoDevice, unless lanes are asked for. Makes it current.
Result<std::unique_ptr<Executor>> open_report_executor(const ExecutorConfig& config);

/// That one, if any; of kAllDevices every executor, the one of `config`'s OpenGL device first.
Result<std::vector<std::unique_ptr<Executor>>> open_report_executors(const ExecutorConfig& config);

}  // namespace strandcast
