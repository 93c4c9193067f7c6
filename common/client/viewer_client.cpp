#include "common/client/viewer_client.h"

#include <utility>

#include "common/client/viewer_connection_private.h"

namespace strandcast {

ClientConfig::ClientConfig() = default;
ClientConfig::ClientConfig(const ClientConfig&) = default;
ClientConfig::ClientConfig(ClientConfig&&) noexcept = default;
ClientConfig& ClientConfig::operator=(const ClientConfig&) = default;
ClientConfig& ClientConfig::operator=(ClientConfig&&) noexcept = default;
ClientConfig::~ClientConfig() = default;

const char* to_string(ConnectStep step) {
  switch (step) {
    case ConnectStep::FindHost:
      return "looking for the host";
    case ConnectStep::Connect:
      return "connecting";
    case ConnectStep::BeginTls:
      return "beginning TLS";
    case ConnectStep::AskForWebSocket:
      return "asking for a WebSocket";
    case ConnectStep::AwaitWelcome:
      return "waiting for the server's Welcome";
  }
  return "connecting";
}

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

Result<std::unique_ptr<ViewerClient>> ViewerClient::connect(const ClientConfig& config) {
  TlsContextPtr tls;
  if (config.address.is_tls) {
    auto made = make_client_tls(config.tls_authorities);
    // A file of ours is no trouble of the server's, which could go away.
    if (!made) return Error{ErrorCode::Unsupported, made.error().message, made.error().place};
    tls = std::move(made).value();
  }
  ASSIGN_OR_RETURN(auto connection, Connection::open(config, tls));
  // A server that knows no names has one head.
  if (!config.hello.head.empty() && connection->welcome().scene_name != config.hello.head)
    return make_error(ErrorCode::NotFound, "the server has one head and none called '{}'", config.hello.head);
  return std::unique_ptr<ViewerClient>(new ViewerClient(std::move(connection)));
}

ViewerClient::ViewerClient(std::unique_ptr<Connection> connection) : connection_(std::move(connection)) {}
ViewerClient::~ViewerClient() = default;

const Welcome& ViewerClient::welcome() const {
  return connection_->welcome();
}
std::vector<ClientEvent> ViewerClient::poll() {
  return connection_->mailbox().take();
}
std::vector<ClientEvent> ViewerClient::wait(std::chrono::milliseconds timeout) {
  return connection_->mailbox().wait(timeout);
}
std::optional<ClientEvent> ViewerClient::next(std::chrono::milliseconds timeout) {
  return connection_->mailbox().next(timeout);
}
Status ViewerClient::send(const ClientMessage& message) {
  return connection_->send(encode(message));
}
void ViewerClient::request_keyframe() {
  connection_->request_keyframe();
}
size_t ViewerClient::queued_messages() const {
  return connection_->queued_messages();
}
ClockOffset ViewerClient::clock() const {
  return connection_->clock();
}
int64_t ViewerClient::heard_ns() const {
  return connection_->heard_ns();
}
ConnectionCounters ViewerClient::counters() const {
  return connection_->counters();
}

}  // namespace strandcast
