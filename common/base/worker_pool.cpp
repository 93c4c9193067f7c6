#include "common/base/worker_pool.h"

#include <algorithm>
#include <atomic>

namespace strandcast {

WorkerPool::WorkerPool(uint32_t threads) {
  for (uint32_t thread = 1; thread < threads; ++thread) threads_.emplace_back([this] { serve(); });
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
  std::unique_lock lock(mutex_);
  work_ = &work;
  next_ = 0;
  is_there_.notify_all();
  while (take_share(lock)) {
  }
  is_done_.wait(lock, [&] { return under_way_ == 0; });
  work_ = nullptr;
}

/// Does one share, if there is one that nobody has begun. `lock` is held, but not during the work.
bool WorkerPool::take_share(std::unique_lock<std::mutex>& lock) {
  if (work_ == nullptr || next_ == size()) return false;
  const auto* work = work_;
  const uint32_t share = next_++;
  ++under_way_;
  lock.unlock();
  (*work)(share);
  lock.lock();
  if (--under_way_ == 0) is_done_.notify_one();
  return true;
}

void WorkerPool::for_ranges(size_t count, size_t grain,
                            const std::function<void(size_t begin, size_t end)>& work) {
  std::atomic<size_t> next{0};
  run([&](uint32_t) {
    for (size_t begin = next.fetch_add(grain); begin < count; begin = next.fetch_add(grain))
      work(begin, std::min(begin + grain, count));
  });
}

void WorkerPool::serve() {
  std::unique_lock lock(mutex_);
  while (!is_stopping_) {
    if (!take_share(lock)) is_there_.wait(lock);
  }
}

}  // namespace strandcast
