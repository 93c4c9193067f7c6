// WorkerPool where there is one thread, instead of common/base/worker_pool.cpp: whoever calls takes all
// ranges.
#include "common/base/worker_pool.h"

namespace strandcast {

WorkerPool::WorkerPool(uint32_t) : size_(1), urgency_(0) {}
WorkerPool::~WorkerPool() = default;

void WorkerPool::share(Call& call, uint32_t) {
  take_ranges(call, 0, Patience::ToTheEnd);
}

bool WorkerPool::take_ranges(Call& call, uint32_t worker, Patience) {
  for (size_t begin = 0; begin < call.count; begin += call.grain)
    call.ranges(call.work, begin, std::min(begin + call.grain, call.count), worker);
  return false;
}

WorkerPool& shared_workers() {
  static WorkerPool pool(1);
  return pool;
}

}  // namespace strandcast
