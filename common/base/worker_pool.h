// WorkerPool: threads that share the work of whoever asks, the most urgent first. shared_workers() is the
// pool of the process: simulation, strand codecs, drawing and loading all take from it, so they never run on
// more threads than there are processors beside their own. Any number of threads may call at the same time.
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

/// Of work, the most urgent first: free threads go there, and leave what is less urgent for it.
enum class Priority : uint32_t { Simulation, Encoding, Drawing, Background };

/// Threads of a pool at most, the caller among them.
inline constexpr uint32_t kMaxWorkers = 64;
/// How much a pool's threads stand back behind other programs (added to their nice level), where the system
/// lets them.
inline constexpr int kWorkerNiceness = 2;

class WorkerPool {
 public:
  /// The caller of for_ranges() is one of `threads`, 1 to kMaxWorkers. The others begin here, a little nicer
  /// than the thread that makes the pool, and sleep while there is nothing to do.
  explicit WorkerPool(uint32_t threads);
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  uint32_t size() const { return size_; }

  /// A call as urgent as this, by `most_workers` threads at most.
  class Terms;
  Terms at(Priority priority, uint32_t most_workers = kMaxWorkers);
  /// at(Priority::Simulation).for_ranges(...).
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
  /// work(begin, end) or work(begin, end, worker) for ranges of `grain` >= 1 (the last one less) that
  /// together are [0, count): each once, in any order, on any thread. `worker` is below size() and
  /// `most_workers`, and no two ranges of this call that run at the same time have the same; the caller's is
  /// 0. Returns when all is done. The caller takes ranges like everybody and waits for those only that
  /// somebody has begun. A thread that is wanted elsewhere ends the range it is at, so that a range should
  /// take less than a millisecond. `work` may call for_ranges() itself; it must not throw, nor wait for
  /// another range.
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
  /// Threads that take part at most.
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

/// The pool of the process: as many threads as there are processors, at most kMaxWorkers, made by the first
/// call. That is for a thread as nice as the program; a nicer one's workers could never be made less so.
WorkerPool& shared_workers();

}  // namespace strandcast
