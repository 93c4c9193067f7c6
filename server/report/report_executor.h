// What runs the solvers of a report.
#pragma once

#include <memory>

#include "server/sim/executor/executor.h"

namespace strandcast {

/// As a GL device: none, but the double-precision references.
inline constexpr const char* kNoDevice = "none";

/// nullptr for kNoDevice, unless lanes are asked for. Makes it current.
Result<std::unique_ptr<Executor>> open_report_executor(const ExecutorConfig& config);

}  // namespace strandcast
