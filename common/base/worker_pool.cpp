#include "common/base/worker_pool.h"

#include <algorithm>
#include <atomic>

namespace strandcast {

WorkerPool::WorkerPool(uint32_t threads) {
  for (uint32_t worker = 1; worker < threads; ++worker)
    threads_.emplace_back([this, worker] { serve(worker); });
}

WorkerPool::~WorkerPool() {
  {
    const std::lock_guard lock(mutex_);
    is_stopping_ = true;
  }
  is_there_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void WorkerPool::run(const std::function<void(uint32_t)>& work) {
  if (threads_.empty()) return work(0);
  {
    const std::lock_guard lock(mutex_);
    work_ = &work;
    left_ = static_cast<uint32_t>(threads_.size());
    ++turn_;
  }
  is_there_.notify_all();
  work(0);
  std::unique_lock lock(mutex_);
  is_done_.wait(lock, [&] { return left_ == 0; });
  work_ = nullptr;
}

void WorkerPool::for_ranges(size_t count, size_t grain,
                            const std::function<void(size_t begin, size_t end)>& work) {
  std::atomic<size_t> next{0};
  run([&](uint32_t) {
    for (size_t begin = next.fetch_add(grain); begin < count; begin = next.fetch_add(grain))
      work(begin, std::min(begin + grain, count));
  });
}

void WorkerPool::serve(uint32_t worker) {
  uint64_t done = 0;
  std::unique_lock lock(mutex_);
  for (;;) {
    is_there_.wait(lock, [&] { return is_stopping_ || turn_ != done; });
    if (is_stopping_) return;
    done = turn_;
    const auto* work = work_;
    lock.unlock();
    (*work)(worker);
    lock.lock();
    if (--left_ == 0) is_done_.notify_one();
  }
}

}  // namespace strandcast
