// WorkerPool: threads that share the work of their callers, the most urgent call first. shared_workers() is
// the pool of the process. Simulation, strand codecs, drawing and loading all use it, so they never run on
// more threads than there are processors. Any number of threads may call at the same time.
#pragma once

#include <algorithm>
#include <atomic>
#include <concepts>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

namespace strandcast {

/// Urgency of a call, the most urgent first. Pool threads leave less urgent work when more urgent work
/// arrives.
enum class Priority : uint32_t { Simulation, Encoding, Drawing, Background };

/// Largest number of threads of a pool, including the calling thread.
inline constexpr uint32_t kMaxWorkers = 64;
/// Nice value added to that of the pool's threads, where the system permits it; other programs then run
/// first.
inline constexpr int kWorkerNiceness = 2;

class WorkerPool {
 public:
  /// Starts `threads` - 1 threads (`threads` is 1 to kMaxWorkers), since the caller of for_ranges() works
  /// too. Their nice value is kWorkerNiceness above that of the constructing thread. They sleep while there
  /// is no work.
  explicit WorkerPool(uint32_t threads);
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  uint32_t size() const { return size_; }

  /// Returns a handle for calls of this priority that use at most `most_workers` threads.
  class Terms;
  Terms at(Priority priority, uint32_t most_workers = kMaxWorkers);
  /// Same as at(Priority::Simulation).for_ranges(...).
  template <class Work>
  void for_ranges(size_t count, size_t grain, const Work& work);

 private:
  using Ranges = void (*)(const void* work, size_t begin, size_t end, uint32_t worker);
  enum class Patience { ToTheEnd, UntilMoreUrgent };
  struct Call {
    Call(Ranges ranges_, const void* work_, size_t count_, size_t grain_, Priority priority_)
        : ranges(ranges_), work(work_), count(count_), grain(grain_), priority(priority_) {}
    const Ranges ranges;
    const void* const work;
    const size_t count;
    const size_t grain;
    const Priority priority;
    std::atomic<size_t> next{0};  // beginning of the ranges that nobody has begun
    // The rest under mutex_.
    uint64_t free_workers = 0;  // a bit for each number that nobody has
    uint32_t helpers = 0;       // threads of the pool that are at it
    std::condition_variable is_left;
  };

  void share(Call& call, uint32_t workers);
  bool take_ranges(Call& call, uint32_t worker, Patience patience);
  void serve();
  Call* most_urgent() const;
  void remove(Call& call);
  void tell_most_urgent();

  const uint32_t size_;
  std::mutex mutex_;
  std::condition_variable is_there_;
  std::vector<Call*> calls_;       // with ranges left, as far as is known; the most urgent first
  std::atomic<uint32_t> urgency_;  // of the most urgent call that has room for one more
  uint32_t idle_ = 0;
  bool is_stopping_ = false;
  std::vector<std::thread> threads_;  // last: they start when everything else is there
};

class WorkerPool::Terms {
 public:
  /// Splits [0, count) into ranges of `grain` >= 1 and calls work(begin, end) or work(begin, end, worker)
  /// once for each.
  /// Ranges run in any order on any thread; the last range may be shorter. `worker` is below size() and
  /// `most_workers`, differs between ranges that run at the same time, and is 0 for the caller. Returns when
  /// all ranges are done. The caller takes ranges too and waits only for ranges that other threads have
  /// begun. A thread changes to more urgent work only between ranges, so a range should take less than a
  /// millisecond. `work` may call for_ranges() itself; it must not throw or wait for another range.
  template <class Work>
  void for_ranges(size_t count, size_t grain, const Work& work) const {
    const Ranges ranges = [](const void* context, size_t begin, size_t end, uint32_t worker) {
      const Work& do_range = *static_cast<const Work*>(context);
      if constexpr (std::invocable<const Work&, size_t, size_t, uint32_t>)
        do_range(begin, end, worker);
      else
        do_range(begin, end);
    };
    Call call(ranges, &work, count, grain, priority_);
    const size_t helped = std::min<size_t>({pool_.size_, most_workers_, (count + grain - 1) / grain});
    if (helped > 1)
      pool_.share(call, static_cast<uint32_t>(helped));
    else
      pool_.take_ranges(call, 0, Patience::ToTheEnd);
  }
  /// Largest number of threads that take part.
  uint32_t workers() const { return std::min(pool_.size(), most_workers_); }

 private:
  friend class WorkerPool;
  Terms(WorkerPool& pool, Priority priority, uint32_t most_workers)
      : pool_(pool), priority_(priority), most_workers_(most_workers) {}

  WorkerPool& pool_;
  Priority priority_;
  uint32_t most_workers_;
};

inline WorkerPool::Terms WorkerPool::at(Priority priority, uint32_t most_workers) {
  return {*this, priority, most_workers};
}
template <class Work>
void WorkerPool::for_ranges(size_t count, size_t grain, const Work& work) {
  at(Priority::Simulation).for_ranges(count, grain, work);
}

/// Returns the pool of the process, which the first call makes with one thread per processor (at most
/// kMaxWorkers). Call it first from a thread with the process's default nice value: workers inherit it, and
/// an unprivileged process cannot lower it again.
WorkerPool& shared_workers();

}  // namespace strandcast
