// Outbox: messages that wait to be sent to the server, in order and bounded in number and bytes. Any thread
// puts in, the network thread takes out. Does not send.
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
  /// LimitExceeded when it is full (the message is dropped), Unavailable once it is closed.
  Status push(std::vector<std::byte> message);
  /// The oldest message, which keeps its place until pop(), so that the bound holds; empty when there is
  /// none.
  std::span<const std::byte> front() const;
  void pop();
  /// Nothing can be put in any more.
  void close();

  size_t message_count() const;

 private:
  mutable std::mutex mutex_;
  std::deque<std::vector<std::byte>> messages_;
  size_t bytes_ = 0;
  bool is_closed_ = false;
};

}  // namespace strandcast
