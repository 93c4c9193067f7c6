// Outbox: messages that wait to be sent to the server, in order and bounded in number and bytes. Any thread
// adds, the network thread removes. Does not send.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <span>
#include <vector>

#include "common/base/result.h"

namespace strandcast {

inline constexpr size_t kMaxSendQueueMessages = 1024;
inline constexpr size_t kMaxSendQueueBytes = 1u << 20;

class Outbox {
 public:
  /// Adds a message. LimitExceeded if the box is full (the message is dropped), Unavailable once it is
  /// closed.
  Status push(std::vector<std::byte> message);
  /// Returns the oldest message, which stays until pop(); empty if there is none.
  std::span<const std::byte> front() const;
  void pop();
  /// Closes the box: nothing can be added any more.
  void close();

  size_t message_count() const;

 private:
  mutable std::mutex mutex_;
  std::deque<std::vector<std::byte>> messages_;
  size_t bytes_ = 0;
  bool is_closed_ = false;
};

}  // namespace strandcast
