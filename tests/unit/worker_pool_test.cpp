// WorkerPool: every range once, whoever calls and however deep; the most urgent call first; nobody waits for
// what nobody has begun.
#include "common/base/worker_pool.h"

#include <gmock/gmock.h>
#include <sys/resource.h>

#include <chrono>
#include <functional>
#include <future>
#include <latch>
#include <numeric>
#include <string>

namespace strandcast::worker_pool_test {
namespace {

using testing::Each;
using testing::ElementsAre;
using testing::Le;

/// How often each index was in a range of such a call.
std::vector<int> times_done(const WorkerPool::Terms& terms, size_t count, size_t grain) {
  std::vector<std::atomic<int>> done(count);
  terms.for_ranges(count, grain, [&](size_t begin, size_t end) {
    EXPECT_LE(end - begin, grain);
    for (size_t i = begin; i < end; ++i) ++done[i];
  });
  return {done.begin(), done.end()};
}

TEST(WorkerPool, DoesEveryRangeOnceAndAgain) {
  for (const uint32_t threads : {1u, 2u, 5u, kMaxWorkers}) {
    WorkerPool workers(threads);
    for (int turn = 0; turn < 20; ++turn)
      for (const size_t count : {0u, 1u, 6u, 7u, 8u, 1000u})
        EXPECT_THAT(times_done(workers.at(Priority::Simulation), count, 7), Each(1));
  }
}

TEST(WorkerPool, NoTwoRangesAtATimeHaveTheSameWorker) {
  WorkerPool workers(6);
  for (const uint32_t most : {1u, 2u, 4u, kMaxWorkers}) {
    const uint32_t numbers = std::min(most, workers.size());
    std::vector<std::atomic<int>> at_work(numbers);
    workers.at(Priority::Drawing, most).for_ranges(2000, 1, [&](size_t, size_t, uint32_t worker) {
      ASSERT_LT(worker, numbers);
      EXPECT_EQ(++at_work[worker], 1);
      std::this_thread::yield();
      --at_work[worker];
    });
  }
}

TEST(WorkerPool, SmallWorkStaysOnItsThread) {
  WorkerPool workers(4);
  workers.for_ranges(10, 10,
                     [caller = std::this_thread::get_id()](size_t begin, size_t end, uint32_t worker) {
                       EXPECT_EQ(std::this_thread::get_id(), caller);
                       EXPECT_THAT((std::array{begin, end, size_t{worker}}), ElementsAre(0, 10, 0));
                     });
}

TEST(WorkerPool, ARangeMayShareWorkItself) {
  for (const uint32_t threads : {1u, 2u, 4u}) {
    WorkerPool workers(threads);
    std::atomic<int> leaves{0};
    const std::function<void(int)> grow = [&](int depth) {
      if (depth == 0) {
        ++leaves;
        return;
      }
      workers.at(static_cast<Priority>(depth % 4)).for_ranges(5, 1, [&](size_t, size_t) { grow(depth - 1); });
    };
    grow(5);
    EXPECT_EQ(leaves, 5 * 5 * 5 * 5 * 5);
  }
}

TEST(WorkerPool, ManyMayCallAtTheSameTime) {
  WorkerPool workers(4);
  std::vector<std::future<void>> callers;
  for (uint32_t caller = 0; caller < 8; ++caller)
    callers.push_back(std::async(std::launch::async, [&workers, caller] {
      const auto terms = workers.at(static_cast<Priority>(caller % 4), 1 + caller % 5);
      for (int turn = 0; turn < 200; ++turn) EXPECT_THAT(times_done(terms, 64 + caller, 1 + caller), Each(1));
    }));
}

/// A pool of one thread besides its callers, held up until told; callers that hold their own first range, so
/// that this thread does all others, and a list of whose they were.
class UrgencyTest : public testing::Test {
 protected:
  UrgencyTest() {
    begin("first", Priority::Drawing, 2, [&] { is_let_go_.wait(); });
    is_held_.wait();
  }

  /// Returns once the call is known to the pool, and its caller at its own range. `on_range` is called in
  /// the others.
  void begin(const std::string& name, Priority priority, size_t ranges, std::function<void()> on_range = {}) {
    std::latch is_begun(1);
    callers_.push_back(std::async(std::launch::async, [=, this, &is_begun] {
      workers_.at(priority).for_ranges(ranges, 1, [&](size_t, size_t, uint32_t worker) {
        if (worker == 0) {
          is_begun.count_down();
          is_over_.wait();
          return;
        }
        is_held_.count_down();
        {
          const std::lock_guard lock(mutex_);
          order_.push_back(name);
        }
        if (on_range) on_range();
        is_all_done_.count_down();
      });
    }));
    is_begun.wait();
  }

  /// What the pool's thread did after the first call's range, once it has done `count` ranges in all.
  std::vector<std::string> order_after_letting_go() {
    is_let_go_.count_down();
    is_all_done_.wait();
    is_over_.count_down();
    callers_.clear();
    return {order_.begin() + 1, order_.end()};
  }

  static constexpr ptrdiff_t kRanges = 8;  // that the pool's thread does in each test, the first included
  WorkerPool workers_{2};
  std::latch is_held_{1};
  std::latch is_let_go_{1};
  std::latch is_all_done_{kRanges};
  std::latch is_over_{1};
  std::mutex mutex_;
  std::vector<std::string> order_;
  std::vector<std::future<void>> callers_;
};

TEST_F(UrgencyTest, TheMostUrgentCallIsFirstAndOfAlikeTheFirst) {
  begin("late", Priority::Background, 2);
  begin("picture", Priority::Drawing, 3);
  begin("step", Priority::Simulation, 2);
  begin("states", Priority::Encoding, 2);
  begin("next picture", Priority::Drawing, 2);
  begin("next step", Priority::Simulation, 2);
  EXPECT_THAT(order_after_letting_go(),
              ElementsAre("step", "next step", "states", "picture", "picture", "next picture", "late"));
}

TEST_F(UrgencyTest, AThreadLeavesItsCallForAMoreUrgentOneAndComesBack) {
  int count = 0;
  begin("picture", Priority::Drawing, 6, [&] {
    if (++count == 2) begin("step", Priority::Simulation, 3);
  });
  EXPECT_THAT(order_after_letting_go(),
              ElementsAre("picture", "picture", "step", "step", "picture", "picture", "picture"));
}

TEST_F(UrgencyTest, ACallerDoesWhatNobodyHasBegun) {
  // The pool's only thread is held up by another call: all of this one's ranges are left to the caller.
  const auto caller = std::this_thread::get_id();
  workers_.for_ranges(100, 1, [&](size_t, size_t) { EXPECT_EQ(std::this_thread::get_id(), caller); });
  begin("rest", Priority::Background, kRanges);
  order_after_letting_go();
}

TEST(WorkerPool, ThreadsSleepWhileThereIsNothingToDo) {
  const auto cpu_s = [] {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    const auto seconds = [](const timeval& time) {
      return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
    };
    return seconds(usage.ru_utime) + seconds(usage.ru_stime);
  };
  WorkerPool workers(8);
  times_done(workers.at(Priority::Simulation), 1000, 1);
  const double before_s = cpu_s();
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  // Spinning, they would have taken as much as all processors have; one at least.
  EXPECT_LT(cpu_s() - before_s, 0.05);
}

TEST(WorkerPool, OtherProgramsGoFirst) {
  WorkerPool workers(2);
  const int own = getpriority(PRIO_PROCESS, 0);
  std::latch both(2);
  workers.for_ranges(2, 1, [&](size_t, size_t, uint32_t worker) {
    both.arrive_and_wait();
    const int level = getpriority(PRIO_PROCESS, static_cast<id_t>(gettid()));
    EXPECT_EQ(level, worker == 0 ? own : std::min(own + kWorkerNiceness, 19));
  });
}

}  // namespace
}  // namespace strandcast::worker_pool_test
