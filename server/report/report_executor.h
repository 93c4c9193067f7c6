// Executors that run the solvers of a report.
#pragma once

#include <memory>
#include <vector>

#include "server/sim/executor/executor.h"

namespace strandcast {

/// Name of the GL device that stands for none: only double-precision references run.
inline constexpr const char* kNoDevice = "none";

/// Name of the simulation device that stands for every executor, in reports that compare them.
inline constexpr const char* kAllDevices = "all";

/// Opens an executor and makes it current; nullptr for kNoDevice, unless lanes are requested.
Result<std::unique_ptr<Executor>> open_report_executor(const ExecutorConfig& config);

/// Opens that executor, if any. For kAllDevices opens every executor, first that of `config`'s OpenGL device.
Result<std::vector<std::unique_ptr<Executor>>> open_report_executors(const ExecutorConfig& config);

}  // namespace strandcast
