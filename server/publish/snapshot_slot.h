// SnapshotSlot: passes the newest published state from the simulation thread to any number of readers. A slow
// reader skips states and never delays the writer. Any thread.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <utility>

#include "common/strands/snapshot.h"

namespace strandcast {

class SnapshotSlot {
 public:
  struct View {
    std::shared_ptr<const Snapshot> snapshot;  // null before the first put()
    uint64_t version = 0;                      // counts put() calls
    bool is_stopped = false;
  };

  void put(std::shared_ptr<const Snapshot> snapshot) {
    {
      const std::lock_guard lock(mutex_);
      view_.snapshot.swap(snapshot);
      ++view_.version;
    }
    changed_.notify_all();
    // The old state is freed here, outside the lock.
  }

  View latest() const {
    const std::lock_guard lock(mutex_);
    return view_;
  }

  /// Waits until `is_ready(view)` or stop(). `is_ready` runs under the slot's lock, so it must be short and
  /// must not call the slot.
  template <class IsReady>
  View wait(IsReady is_ready) const {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return view_.is_stopped || is_ready(std::as_const(view_)); });
    return view_;
  }

  /// Waits like wait(), but at most for `timeout`.
  template <class IsReady>
  View wait_for(std::chrono::nanoseconds timeout, IsReady is_ready) const {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, timeout, [&] { return view_.is_stopped || is_ready(std::as_const(view_)); });
    return view_;
  }

  /// Makes every waiting reader check again; call it after changing what its `is_ready` depends on.
  void notify() {
    // A reader between its check and its sleep holds the lock; this cannot slip in between.
    { const std::lock_guard lock(mutex_); }
    changed_.notify_all();
  }

  /// Wakes all readers permanently.
  void stop() {
    {
      const std::lock_guard lock(mutex_);
      view_.is_stopped = true;
    }
    changed_.notify_all();
  }

 private:
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  View view_;
};

}  // namespace strandcast
