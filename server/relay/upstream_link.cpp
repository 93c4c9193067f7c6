#include "server/relay/upstream_link.h"

#include <algorithm>
#include <utility>

#include "common/base/profile.h"
#include "common/base/thread_name.h"
#include "common/log/log.h"

namespace strandcast {
namespace {

/// How often a thread that hears nothing looks whether it is to end.
constexpr std::chrono::milliseconds kLinkLookInterval{200};

}  // namespace

ClientConfig client_config_for(const UpstreamConfig& config, const Hello& hello) {
  ClientConfig client;
  client.address = config.address;
  client.tls_authorities = config.tls_authorities;
  client.hello = hello;
  return client;
}

EncodedFramePtr frame_of(MediaEvent media) {
  return std::make_shared<EncodedFrame>(EncodedFrame{media.header, std::move(media.message)});
}

UpstreamLink::UpstreamLink(ClientConfig config, Hooks hooks)
    : config_(std::move(config)), hooks_(std::move(hooks)) {
  config_.cancel = [this]() -> std::optional<Error> {
    if (!is_stopping_) return std::nullopt;
    return make_error(ErrorCode::Unavailable, "the relay ends this session");
  };
  thread_ = std::thread([this] { run(); });
}

UpstreamLink::~UpstreamLink() {
  begin_stop();
  thread_.join();
}

void UpstreamLink::begin_stop() {
  const std::lock_guard lock(mutex_);
  is_stopping_ = true;
  stopped_.notify_all();
}

void UpstreamLink::send(const ClientMessage& message) {
  const std::lock_guard lock(mutex_);
  if (client_ == nullptr) {
    if (waiting_.size() < kMaxWaitingMessages) waiting_.push_back(message);
    return;
  }
  // What does not fit is lost like on a link that is cut; the session's end is told by itself.
  if (const Status sent = client_->send(message); !sent)
    log_debug("relay", "not sent on: {}", sent.error().to_string());
}

void UpstreamLink::request_keyframe() {
  const std::lock_guard lock(mutex_);
  if (client_ != nullptr) client_->request_keyframe();
}

ClockOffset UpstreamLink::clock() const {
  const std::lock_guard lock(mutex_);
  return client_ != nullptr ? client_->clock() : ClockOffset();
}

uint64_t UpstreamLink::received_bytes() const {
  const std::lock_guard lock(mutex_);
  return earlier_bytes_ + (client_ != nullptr ? client_->counters().received_bytes : 0);
}

void UpstreamLink::run() {
  name_thread("upstream");
  ReconnectPolicy policy(static_cast<uint32_t>(now_ns()), kLongestUrgentDelay);
  while (!is_stopping_) {
    const Error error = serve(policy);
    if (is_stopping_ || !hooks_.on_lost(error)) return;
    const auto delay = policy.on_lost(error, now_ns());
    if (next_ != nullptr) continue;
    std::unique_lock lock(mutex_);
    stopped_.wait_for(lock, delay.value_or(kLongestUrgentDelay), [this] { return is_stopping_.load(); });
  }
}

Status UpstreamLink::connect() {
  if (next_ != nullptr) return {};
  ASSIGN_OR_RETURN(next_, ViewerClient::connect(config_));
  return {};
}

/// One session, from the connection to its end.
Error UpstreamLink::serve(ReconnectPolicy& policy) {
  if (const Status connected = connect(); !connected) return connected.error();
  const std::unique_ptr<ViewerClient> client = std::move(next_);
  policy.on_welcome(now_ns());
  if (const Status welcome = hooks_.on_welcome(client->welcome()); !welcome)
    return at(config_.address.to_string(), welcome.error());
  {
    const std::lock_guard lock(mutex_);
    client_ = client.get();
    lost_for_.reset();
    for (const ClientMessage& message : std::exchange(waiting_, {})) (void)client_->send(message);
  }
  Error error = hear(*client);
  const std::lock_guard lock(mutex_);
  earlier_bytes_ += client_->counters().received_bytes;
  client_ = nullptr;
  return error;
}

void UpstreamLink::lose(Error error) {
  const std::lock_guard lock(mutex_);
  lost_for_ = std::move(error);
}

Error UpstreamLink::hear(ViewerClient& client) {
  bool was_silent = false;
  Attempts<ViewerClient> beside(config_, &ViewerClient::connect, kLongestUrgentDelay);
  while (!is_stopping_) {
    std::optional<ClientEvent> event = client.next(kLinkLookInterval);
    const bool is_quiet = is_silent(client.heard_ns(), now_ns());
    if (std::exchange(was_silent, is_quiet) != is_quiet && hooks_.on_silence) hooks_.on_silence(is_quiet);
    {
      const std::lock_guard lock(mutex_);
      if (lost_for_) return *std::exchange(lost_for_, std::nullopt);
    }
    next_ = beside.pump_beside({client.heard_ns()});
    if (next_ != nullptr)
      return at(config_.address.to_string(),
                make_error(ErrorCode::Timeout, "nothing has come for {} ms, and a new connection takes over",
                           kDoubtedServer.count()));
    if (!event) continue;
    if (const auto* closed = std::get_if<ClosedEvent>(&*event)) return closed->error;
    hooks_.on_event(std::move(*event));
  }
  return make_error(ErrorCode::Unavailable, "the relay ended this session");
}

}  // namespace strandcast
