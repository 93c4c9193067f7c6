// SharedSlot: passes the strands that viewers have from the encoder to the simulation that goes on from them.
// The newest update counts. Any thread.
#pragma once

#include <atomic>
#include <mutex>
#include <optional>
#include <utility>

#include "common/strands/shared_strands.h"

namespace strandcast {

class SharedSlot {
 public:
  /// Sets whether the simulation takes updates; encoders make none otherwise.
  void set_wanted(bool is_wanted) { is_wanted_ = is_wanted; }
  bool is_wanted() const { return is_wanted_; }

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

 private:
  std::atomic<bool> is_wanted_{false};
  std::mutex mutex_;
  std::optional<SharedUpdate> update_;
};

}  // namespace strandcast
