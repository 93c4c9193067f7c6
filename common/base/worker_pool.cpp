#include "common/base/worker_pool.h"

#include <bit>
#include <limits>
#include <system_error>

#ifdef __linux__
#include <sys/resource.h>
#include <unistd.h>
#endif

#include "common/base/check.h"
#include "common/base/thread_name.h"

namespace strandcast {
namespace {

constexpr uint32_t kNothingUrgent = std::numeric_limits<uint32_t>::max();

constexpr uint32_t rank(Priority priority) {
  return static_cast<uint32_t>(priority);
}

/// Of the calling thread. What the system refuses changes nothing but who waits for whom.
void stand_back() {
#ifdef __linux__
  const auto thread = static_cast<id_t>(gettid());
  setpriority(PRIO_PROCESS, thread, getpriority(PRIO_PROCESS, thread) + kWorkerNiceness);
#endif
}

}  // namespace

WorkerPool::WorkerPool(uint32_t threads) : size_(threads), urgency_(kNothingUrgent) {
  CHECK(threads >= 1 && threads <= kMaxWorkers);
  threads_.reserve(size_ - 1);
  try {
    for (uint32_t thread = 1; thread < size_; ++thread) threads_.emplace_back([this] { serve(); });
  } catch (const std::system_error&) {
    // Fewer threads than wanted are slower and no fault.
  }
}

WorkerPool::~WorkerPool() {
  {
    const std::lock_guard lock(mutex_);
    is_stopping_ = true;
  }
  is_there_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

/// Gives the ranges to `workers` threads, the caller's among them.
void WorkerPool::share(Call& call, uint32_t workers) {
  const uint64_t callers_own = 1;
  call.free_workers = (workers == 64 ? ~uint64_t{0} : (uint64_t{1} << workers) - 1) & ~callers_own;
  uint32_t woken = 0;
  {
    const std::lock_guard lock(mutex_);
    const auto after = std::find_if(calls_.begin(), calls_.end(),
                                    [&](const Call* other) { return other->priority > call.priority; });
    calls_.insert(after, &call);
    tell_most_urgent();
    woken = std::min(idle_, workers - 1);
  }
  for (; woken > 0; --woken) is_there_.notify_one();
  take_ranges(call, 0, Patience::ToTheEnd);
  std::unique_lock lock(mutex_);
  remove(call);
  call.is_left.wait(lock, [&] { return call.helpers == 0; });
}

/// False when none is left; true when something more urgent waits.
bool WorkerPool::take_ranges(Call& call, uint32_t worker, Patience patience) {
  for (;;) {
    if (patience == Patience::UntilMoreUrgent &&
        urgency_.load(std::memory_order_relaxed) < rank(call.priority))
      return true;
    const size_t begin = call.next.fetch_add(call.grain, std::memory_order_relaxed);
    if (begin >= call.count) return false;
    call.ranges(call.work, begin, std::min(begin + call.grain, call.count), worker);
  }
}

void WorkerPool::serve() {
  name_thread("worker");
  stand_back();
  std::unique_lock lock(mutex_);
  while (!is_stopping_) {
    Call* const call = most_urgent();
    if (call == nullptr) {
      ++idle_;
      is_there_.wait(lock);
      --idle_;
      continue;
    }
    const auto worker = static_cast<uint32_t>(std::countr_zero(call->free_workers));
    call->free_workers &= ~(uint64_t{1} << worker);
    ++call->helpers;
    tell_most_urgent();
    lock.unlock();
    const bool has_more = take_ranges(*call, worker, Patience::UntilMoreUrgent);
    lock.lock();
    call->free_workers |= uint64_t{1} << worker;
    --call->helpers;
    if (!has_more) remove(*call);
    tell_most_urgent();
    // Still locked: the caller cannot go on, and take the call with it, before this is over.
    if (call->helpers == 0) call->is_left.notify_one();
  }
}

/// Locked. nullptr: there is nothing to do.
WorkerPool::Call* WorkerPool::most_urgent() const {
  const auto found =
      std::find_if(calls_.begin(), calls_.end(), [](const Call* call) { return call->free_workers != 0; });
  return found == calls_.end() ? nullptr : *found;
}

/// Locked.
void WorkerPool::remove(Call& call) {
  std::erase(calls_, &call);
  tell_most_urgent();
}

/// Locked; after every change of what most_urgent() says.
void WorkerPool::tell_most_urgent() {
  const Call* const call = most_urgent();
  urgency_.store(call == nullptr ? kNothingUrgent : rank(call->priority), std::memory_order_relaxed);
}

WorkerPool& shared_workers() {
  static WorkerPool pool(std::clamp(std::thread::hardware_concurrency(), 1u, kMaxWorkers));
  return pool;
}

}  // namespace strandcast
