// WorkerPool: threads that wait for work which all of them share. One caller at a time.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace strandcast {

class WorkerPool {
 public:
  /// The caller of run() is one of `threads` >= 1.
  explicit WorkerPool(uint32_t threads);
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  uint32_t size() const { return static_cast<uint32_t>(threads_.size()) + 1; }
  /// work(worker) once for each worker below size(), side by side where a thread is free: the caller does
  /// the shares of threads that have not begun, and waits for none that has nothing to do. Returns when all
  /// shares are done. `work` must not throw, nor wait for another share.
  void run(const std::function<void(uint32_t worker)>& work);
  /// work(begin, end) for ranges of `grain` that together are [0, count), in any order, on any worker.
  void for_ranges(size_t count, size_t grain, const std::function<void(size_t begin, size_t end)>& work);

 private:
  void serve();
  bool take_share(std::unique_lock<std::mutex>& lock);

  std::mutex mutex_;
  std::condition_variable is_there_;
  std::condition_variable is_done_;
  const std::function<void(uint32_t)>* work_ = nullptr;
  uint32_t next_ = 0;  // share that nobody has begun; all are while this is size() or there is no work
  uint32_t under_way_ = 0;
  bool is_stopping_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace strandcast
