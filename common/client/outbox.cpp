#include "common/client/outbox.h"

#include <utility>

namespace strandcast {

Status Outbox::push(std::vector<std::byte> message) {
  const std::lock_guard lock(mutex_);
  if (is_closed_) return make_error(ErrorCode::Unavailable, "the connection is closed");
  if (messages_.size() >= kMaxSendQueueMessages || bytes_ + message.size() > kMaxSendQueueBytes)
    return make_error(ErrorCode::LimitExceeded, "{} messages ({} bytes) wait to be sent already",
                      messages_.size(), bytes_);
  bytes_ += message.size();
  messages_.push_back(std::move(message));
  return {};
}

std::span<const std::byte> Outbox::front() const {
  const std::lock_guard lock(mutex_);
  // A deque that grows at its end leaves the others where they are.
  return messages_.empty() ? std::span<const std::byte>() : std::span<const std::byte>(messages_.front());
}

void Outbox::pop() {
  const std::lock_guard lock(mutex_);
  bytes_ -= messages_.front().size();
  messages_.pop_front();
}

void Outbox::close() {
  const std::lock_guard lock(mutex_);
  is_closed_ = true;
}

size_t Outbox::message_count() const {
  const std::lock_guard lock(mutex_);
  return messages_.size();
}

}  // namespace strandcast
