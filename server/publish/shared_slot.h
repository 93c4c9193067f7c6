// SharedSlot: passes the strands that viewers have from the encoder to the simulation that goes on from them,
// and back. The newest ones count. Any thread.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "common/strands/shared_strands.h"

namespace strandcast {

class SharedSlot {
 public:
  /// Sets which updates the simulation takes; encoders make no others.
  void set_wanted(SharedStates wanted) { wanted_ = wanted; }
  SharedStates wanted() const { return wanted_; }

  void put(SharedUpdate update) {
    const std::lock_guard lock(mutex_);
    // Strands come once for a model.
    if (update_ && update.strands == nullptr && update_->model == update.model)
      update.strands = std::move(update_->strands);
    update_ = std::move(update);
  }
  std::optional<SharedUpdate> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(update_, std::nullopt);
  }

  /// Keeps the simulation's state of this tick, and the one before.
  void put_state(uint64_t tick, std::shared_ptr<const SharedState> state) {
    const std::lock_guard lock(mutex_);
    states_[1] = std::exchange(states_[0], {tick, std::move(state)});
  }
  /// Returns it once; null if it is not there.
  std::shared_ptr<const SharedState> take_state(uint64_t tick) {
    read_tick_ = tick;
    const std::lock_guard lock(mutex_);
    for (auto& [of_tick, state] : states_)
      if (of_tick == tick) return std::exchange(state, nullptr);
    return nullptr;
  }
  /// Returns whether somebody is likely to take the state of this tick.
  bool is_read(uint64_t tick) const { return tick <= read_tick_ + kMostTrailTicks; }

  /// Sets whether an encoder takes every published state in its turn.
  void set_followed(bool is_followed) {
    {
      const std::lock_guard lock(mutex_);
      is_followed_ = is_followed;
    }
    encoded_.notify_all();
  }
  /// Says that the state of this tick is encoded, and what it led to was put here.
  void set_encoded(uint64_t tick) {
    {
      const std::lock_guard lock(mutex_);
      encoded_tick_ = tick;
    }
    encoded_.notify_all();
  }
  /// Waits for the encoder of every state, kLongestEncode at most. Where time is counted in steps, it decides
  /// nothing then how quick the encoder is.
  void wait_encoded(uint64_t tick) {
    std::unique_lock lock(mutex_);
    encoded_.wait_for(lock, kLongestEncode, [&] { return !is_followed_ || encoded_tick_ == tick; });
  }

 private:
  static constexpr std::chrono::seconds kLongestEncode{1};

  std::atomic<SharedStates> wanted_{SharedStates::None};
  std::mutex mutex_;
  std::optional<SharedUpdate> update_;
  std::array<std::pair<uint64_t, std::shared_ptr<const SharedState>>, 2> states_;
  std::atomic<uint64_t> read_tick_{0};
  std::condition_variable encoded_;
  bool is_followed_ = false;
  uint64_t encoded_tick_ = 0;
};

}  // namespace strandcast
