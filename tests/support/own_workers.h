// Pools of a test's own: results must not depend on how many threads there are.
#pragma once

#include <memory>
#include <vector>

#include "common/base/worker_pool.h"

namespace strandcast {

/// The same pool for every call with the same number, until the program ends. From one thread.
inline WorkerPool* own_workers(uint32_t threads) {
  static std::vector<std::unique_ptr<WorkerPool>> pools(kMaxWorkers + 1);
  if (!pools.at(threads)) pools[threads] = std::make_unique<WorkerPool>(threads);
  return pools[threads].get();
}

}  // namespace strandcast
