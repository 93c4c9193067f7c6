#include <algorithm>
#include <boost/asio/connect.hpp>
#include <boost/asio/post.hpp>
#include <string_view>
#include <utility>

#include "common/base/base64.h"
#include "common/base/profile.h"
#include "common/base/text.h"
#include "common/client/connection_error_private.h"
#include "common/client/reconnect_policy.h"
#include "common/client/viewer_connection_private.h"
#include "common/log/log.h"
#include "common/strands/asset/layout.h"
#include "common/wire/early_hello.h"

namespace strandcast {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;

constexpr std::chrono::milliseconds kCloseTimeout{250};
constexpr std::chrono::milliseconds kFarewellTimeout{1000};  // from Goodbye to the close frame
constexpr size_t kMaxCloseReasonBytes = 123;  // RFC 6455, section 5.5: 125 in a control frame, 2 are the code
constexpr size_t kMaxOutstandingPings = 32;

std::string_view view(beast::string_view text) {
  return {text.data(), text.size()};
}

/// A Pong that answers no ping of ours is ignored at any time.
bool may_come_first(const ServerMessage& message) {
  return std::holds_alternative<Welcome>(message) || std::holds_alternative<Goodbye>(message) ||
         std::holds_alternative<Pong>(message);
}

/// What came is no HTTP, or no answer to the request; else the connection broke.
bool is_garbage(const boost::system::error_code& failure) {
  if (failure == http::error::end_of_stream || failure == http::error::partial_message) return false;
  return failure.category() == boost::system::error_code(http::error::bad_version).category() ||
         failure.category() == boost::system::error_code(websocket::error::no_connection).category();
}

websocket::close_code close_code_for(const Error& error) {
  return error.code == ErrorCode::BadInput || error.code == ErrorCode::LimitExceeded
             ? websocket::close_code::protocol_error
             : websocket::close_code::normal;
}

// What the server wrote for people, fit for a terminal.
void clean(ServerStatus&) {}
void clean(LookChange&) {}
void clean(SceneText&) {}  // whoever takes it parses it
void clean(CameraChange&) {}
void clean(StateTimes&) {}
void clean(Welcome& welcome) {
  for (std::string* text : {&welcome.server_version, &welcome.scene_name, &welcome.mode_reason,
                            &welcome.codec, &welcome.codec_reason, &welcome.sim_device})
    *text = one_line(*text);
}
void clean(StreamQuality& quality) {
  quality.reason = one_line(quality.reason);
  quality.codec = one_line(quality.codec);
}
void clean(StreamList& streams) {
  for (std::string& codec : streams.codecs) codec = one_line(codec);
  streams.reason = one_line(streams.reason);
  streams.solver = one_line(streams.solver);
}
/// Whole: it may speak of several heads.
void clean(Notice& notice) {
  notice.text = one_line(notice.text, kMaxTextChars);
}
void clean(ParameterList& list) {
  for (ParameterInfo& parameter : list.parameters)
    for (std::string* text :
         {&parameter.path, &parameter.value, &parameter.unset_value, &parameter.unit, &parameter.note})
      *text = one_line(*text);
}
void clean(SessionList& list) {
  for (SessionInfo& session : list.sessions) {
    session.name = one_line(session.name);
    session.address = one_line(session.address);
  }
}
template <class WithReason>
void clean(WithReason& change) {
  change.reason = one_line(change.reason);
}

}  // namespace

ViewerClient::Connection::Connection(const ClientConfig& config, TlsContextPtr tls)
    : config_(config),
      tls_(std::move(tls)),
      resolver_(io_),
      ws_(net::NetStream(tcp::socket(io_))),
      deadline_(io_),
      ping_timer_(io_),
      mailbox_(config.mailbox) {}

ViewerClient::Connection::~Connection() {
  if (!thread_.joinable()) return;
  asio::post(io_, [this] { finish(make_error(ErrorCode::Unavailable, "closed by the application")); });
  thread_.join();
}

/// As RFC 8305 has it of addresses: what hangs is not waited for alone. The first that is let in is taken,
/// and the first error ends them all: its sender tries again.
Result<std::unique_ptr<ViewerClient::Connection>> ViewerClient::Connection::open(const ClientConfig& config,
                                                                                 const TlsContextPtr& tls) {
  std::vector<std::unique_ptr<Connection>> begun;
  ClientConfig beside = config;
  beside.on_step = {};  // the first tells
  int64_t next_ns = now_ns();
  while (true) {
    if (begun.size() < kMostBeside && now_ns() >= next_ns) {
      begun.push_back(std::make_unique<Connection>(begun.empty() ? config : beside, tls));
      begun.back()->begin();
      next_ns = now_ns() + std::chrono::nanoseconds(kDoubtedServer).count();
    }
    for (auto& connection : begun) {
      const bool is_newest = connection == begun.back();
      const auto outcome = connection->outcome(is_newest ? kCancelPoll : std::chrono::milliseconds(0));
      if (outcome && !*outcome) return outcome->error();
      if (outcome) return std::move(connection);
    }
    if (auto reason = config.cancel ? config.cancel() : std::nullopt)
      return at(config.address.to_string(), std::move(*reason));
  }
}

void ViewerClient::Connection::begin() {
  asio::post(io_, [this] { resolve(); });
  thread_ = std::thread([this] { run(); });
}

std::optional<Status> ViewerClient::Connection::outcome(std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  opened_.wait_for(lock, timeout, [this] { return outcome_.has_value(); });
  return outcome_;
}

Status ViewerClient::Connection::send(std::vector<std::byte> message) {
  RETURN_IF_ERROR(outbox_.push(std::move(message)));
  asio::post(io_, [this] { write_next(); });
  return {};
}

void ViewerClient::Connection::request_keyframe() {
  {
    const std::lock_guard lock(mutex_);
    const auto now = std::chrono::steady_clock::now();
    if (last_keyframe_request_ && now - *last_keyframe_request_ < kKeyframeRequestInterval) return;
    last_keyframe_request_ = now;
  }
  // A full outbox means the server is not reading: asking again later is all that can be done.
  if (auto sent = send(encode(ClientMessage(KeyframeRequest{}))); !sent)
    log_debug("net", "keyframe request not sent: {}", sent.error().to_string());
}

ClockOffset ViewerClient::Connection::clock() const {
  const std::lock_guard lock(mutex_);
  return clock_;
}

ConnectionCounters ViewerClient::Connection::counters() const {
  const std::lock_guard lock(mutex_);
  ConnectionCounters counters = counters_;
  counters.dropped_frames = mailbox_.dropped_frames();
  return counters;
}

void ViewerClient::Connection::run() {
  try {
    io_.run();
  } catch (const std::exception& failure) {
    is_finished_ = true;
    publish_end(make_error(ErrorCode::Internal, "the network thread failed: {}", failure.what()));
  }
}

// ---- opening: name, TCP, WebSocket, Hello ----

void ViewerClient::Connection::note_step(ConnectStep step) const {
  if (config_.on_step) config_.on_step(step);
}

void ViewerClient::Connection::resolve() {
  note_step(ConnectStep::FindHost);
  set_deadline(config_.connect_timeout, "did not answer");
  resolver_.async_resolve(config_.address.host, std::to_string(config_.address.port),
                          [this](error_code failure, const tcp::resolver::results_type& results) {
                            if (is_finished_) return;
                            if (failure)
                              return finish(make_error(ErrorCode::Unavailable, "cannot find host '{}': {}",
                                                       one_line(config_.address.host), failure.message()));
                            connect_tcp(results);
                          });
}

void ViewerClient::Connection::connect_tcp(const tcp::resolver::results_type& results) {
  note_step(ConnectStep::Connect);
  asio::async_connect(ws_.next_layer().socket(), results, [this](error_code failure, const tcp::endpoint&) {
    if (is_finished_) return;
    if (failure)
      return finish(make_error(ErrorCode::Unavailable, "cannot connect: {} (is strandcast-server running?)",
                               failure.message()));
    error_code ignored;
    ws_.next_layer().socket().set_option(tcp::no_delay(true), ignored);
    if (tls_ == nullptr) return upgrade();
    connect_tls();
  });
}

void ViewerClient::Connection::connect_tls() {
  note_step(ConnectStep::BeginTls);
  ws_.next_layer().async_connect_tls(tls_, config_.address.host, [this](error_code failure) {
    if (is_finished_) return;
    if (failure) return finish(error_from_tls(ws_.next_layer(), failure));
    upgrade();
  });
}

void ViewerClient::Connection::upgrade() {
  note_step(ConnectStep::AskForWebSocket);
  websocket::stream_base::timeout timeout{};
  timeout.handshake_timeout = config_.connect_timeout;
  timeout.idle_timeout = config_.idle_timeout;
  timeout.keep_alive_pings = true;
  ws_.set_option(timeout);
  const std::string greeting = base64_of(encode(ClientMessage(hello())));
  ws_.set_option(websocket::stream_base::decorator([greeting](websocket::request_type& request) {
    request.set(http::field::sec_websocket_protocol, kWebSocketProtocol);
    request.set(http::field::user_agent, "strandcast");
    if (greeting.size() <= kMaxHelloFieldBytes) request.set(kHelloField, greeting);
  }));
  ws_.read_message_max(kMaxMessageBytes);
  ws_.binary(true);
  // Header, body, trailer: whatever it consists of, the answer to the request is bounded.
  ws_.next_layer().limit_reading(kMaxUpgradeAnswerBytes);
  const std::string path = config_.address.folder() + config_.path;
  ws_.async_handshake(response_, config_.address.authority(), path, [this](error_code failure) {
    if (is_finished_) return;
    ws_.next_layer().limit_reading(net::NetStream::kNoReadLimit);
    if (is_too_long(failure))
      return finish(make_error(ErrorCode::BadInput,
                               "the server's answer to the request for a WebSocket has more than {} bytes",
                               kMaxUpgradeAnswerBytes));
    if (failure == websocket::error::upgrade_declined)
      return finish(error_from_http(response_.result_int(), view(response_.reason()), response_.body()));
    if (failure)
      return finish(make_error(is_garbage(failure) ? ErrorCode::BadInput : ErrorCode::Unavailable,
                               "the WebSocket handshake failed: {}", failure.message()));
    greet();
  });
}

void ViewerClient::Connection::greet() {
  note_step(ConnectStep::AwaitWelcome);
  is_open_ = true;
  const auto chosen = response_[http::field::sec_websocket_protocol];
  if (chosen != kWebSocketProtocol)
    return finish(make_error(ErrorCode::Unsupported,
                             "the server speaks protocol '{}', this program needs '{}'",
                             one_line(view(chosen)), kWebSocketProtocol));
  set_deadline(config_.welcome_timeout, "sent no Welcome");
  if (view(response_[kHelloField]) != kHelloTaken)
    if (auto sent = send(encode(ClientMessage(hello()))); !sent) return finish(sent.error());
  read_next();
}

Hello ViewerClient::Connection::hello() const {
  Hello hello = config_.hello;
  hello.asset_layout = static_cast<uint32_t>(newest_asset_layout());
  return hello;
}

void ViewerClient::Connection::set_deadline(std::chrono::milliseconds timeout, const char* complaint) {
  deadline_.expires_after(timeout);
  deadline_.async_wait([this, timeout, complaint](error_code failure) {
    if (failure || is_finished_) return;
    finish(make_error(ErrorCode::Timeout, "the server {} for {} ms", complaint, timeout.count()));
  });
}

// ---- reading ----

void ViewerClient::Connection::read_next() {
  ws_.async_read(buffer_, [this](error_code failure, size_t) {
    if (is_finished_) return;
    if (failure) return finish(error_from_stream(failure));
    const auto data = buffer_.cdata();
    const std::span bytes(static_cast<const std::byte*>(data.data()), data.size());
    if (auto handled = handle(bytes); !handled) {
      finish(handled.error(), close_code_for(handled.error()));
      return;
    }
    buffer_.consume(buffer_.size());
    if (!is_finished_) read_next();
  });
}

Error ViewerClient::Connection::error_from_stream(const error_code& failure) {
  const auto& close = ws_.reason();
  const std::string reason =
      goodbye_.empty() ? one_line(std::string_view(close.reason.data(), close.reason.size())) : goodbye_;
  if (failure == websocket::error::closed) return error_from_close(close.code, reason);
  if (!goodbye_.empty()) return error_from_close(0, reason);
  // Beast tells one of what was under way that the time is over, maybe its own ping, and aborts the others.
  if (failure == beast::error::timeout || failure == asio::error::operation_aborted)
    return make_error(ErrorCode::Timeout, "nothing received for {} ms", config_.idle_timeout.count());
  if (failure == websocket::error::message_too_big || failure == websocket::error::buffer_overflow)
    return make_error(ErrorCode::BadInput, "the server sent a message of more than {} bytes",
                      kMaxMessageBytes);
  const bool is_protocol = failure.category() == error_code(websocket::error::closed).category();
  return make_error(is_protocol ? ErrorCode::BadInput : ErrorCode::Unavailable, "connection lost: {}",
                    failure.message());
}

Status ViewerClient::Connection::handle(std::span<const std::byte> bytes) {
  {
    const std::lock_guard lock(mutex_);
    counters_.received_bytes += bytes.size();
    ++counters_.received_messages;
  }
  if (!ws_.got_binary()) return make_error(ErrorCode::BadInput, "the server sent a text message");
  if (bytes.empty()) return make_error(ErrorCode::BadInput, "the server sent an empty message");
  if (static_cast<Opcode>(bytes[0]) == Opcode::Control) {
    Result<ServerMessage> message = decode_server_message(bytes);
    // Of a kind that came with a later version: what we know goes on without it.
    if (!message && message.error().code == ErrorCode::Unsupported) return leave_out();
    if (!message) return message.error();
    if (!is_welcome_ && !may_come_first(*message))
      return make_error(ErrorCode::BadInput, "the server sent something else before its Welcome");
    return std::visit([this](auto& part) { return handle_control(part); }, *message);
  }
  const Result<FrameHeader> header = unpack_frame_header(bytes);
  if (!header && header.error().code == ErrorCode::Unsupported) {
    if (is_welcome_) return leave_out();
    // No version of ours began so: what speaks there may be another thing the next time.
    return make_error(ErrorCode::BadInput, "the server began with something else than its Welcome: {}",
                      header.error().message);
  }
  if (!header) return header.error();
  if (!is_welcome_) return make_error(ErrorCode::BadInput, "the server sent media before its Welcome");
  MediaEvent event{*header, {bytes.begin(), bytes.end()}, now_ns()};
  if (mailbox_.push(std::move(event)) == Mailbox::Outcome::KeyframeNeeded) request_keyframe();
  return {};
}

Status ViewerClient::Connection::leave_out() {
  const std::lock_guard lock(mutex_);
  ++counters_.unknown_messages;
  return {};
}

Status ViewerClient::Connection::handle_control(Welcome& welcome) {
  if (is_welcome_) return make_error(ErrorCode::BadInput, "the server sent a second Welcome");
  is_welcome_ = true;
  deadline_.cancel();
  clean(welcome);
  welcome_ = std::move(welcome);
  ping_next();
  {
    const std::lock_guard lock(mutex_);
    outcome_ = Status();
  }
  opened_.notify_all();
  return {};
}

Status ViewerClient::Connection::handle_control(Goodbye& goodbye) {
  // The close code that follows says whether to come back; a server that sends none gets no more patience,
  // also not by saying goodbye again.
  if (!goodbye_.empty()) return {};
  goodbye_ = one_line(goodbye.reason);
  if (goodbye_.empty()) goodbye_ = "no reason given";
  deadline_.expires_after(kFarewellTimeout);
  deadline_.async_wait([this](error_code failure) {
    if (!failure && !is_finished_) finish(error_from_close(0, goodbye_));
  });
  return {};
}

Status ViewerClient::Connection::handle_control(Pong& pong) {
  // Only answers to our own probes count, so a server cannot feed the clock made-up round trips.
  const auto sent = std::find(outstanding_pings_.begin(), outstanding_pings_.end(), pong.client_time_ns);
  if (sent == outstanding_pings_.end()) return {};
  outstanding_pings_.erase(sent);
  const std::lock_guard lock(mutex_);
  clock_.add(pong.client_time_ns, pong.server_receive_ns, pong.server_send_ns, now_ns());
  return {};
}

template <class Event>
Status ViewerClient::Connection::handle_control(Event& event) {
  clean(event);
  mailbox_.push(std::move(event));
  return {};
}

// ---- writing ----

void ViewerClient::Connection::write_next() {
  if (is_writing_ || !is_open_ || is_finished_) return;
  const std::span<const std::byte> message = outbox_.front();
  if (message.empty()) return;
  is_writing_ = true;
  ws_.async_write(asio::buffer(message.data(), message.size()), [this](error_code failure, size_t) {
    is_writing_ = false;
    outbox_.pop();
    {
      const std::lock_guard lock(mutex_);
      ++counters_.sent_messages;
    }
    if (is_finished_) return;
    // Whichever comes first, the read or a write, is told that the time is over.
    if (failure) return finish(error_from_stream(failure));
    write_next();
  });
}

void ViewerClient::Connection::ping_next() {
  if (is_finished_) return;
  const int64_t time_ns = now_ns();
  outstanding_pings_.push_back(time_ns);
  if (outstanding_pings_.size() > kMaxOutstandingPings) outstanding_pings_.pop_front();
  // A probe that does not fit is lost like one on the network; the next one follows soon.
  if (auto sent = send(encode(ClientMessage(Ping{time_ns}))); !sent)
    log_debug("net", "clock probe not sent: {}", sent.error().to_string());
  ping_timer_.expires_after(++ping_count_ < kQuickPings ? kQuickPingInterval : kPingInterval);
  ping_timer_.async_wait([this](error_code failure) {
    if (!failure) ping_next();
  });
}

// ---- ending ----

void ViewerClient::Connection::finish(Error error, websocket::close_code code) {
  if (is_finished_) return;
  is_finished_ = true;
  ping_timer_.cancel();
  resolver_.cancel();
  error = at(config_.address.to_string(), std::move(error));
  const std::string reason = code == websocket::close_code::normal ? "" : error.message;
  publish_end(std::move(error));
  deadline_.cancel();
  if (!is_open_ || !ws_.is_open() || is_doubted(heard_ns(), now_ns())) return hard_close();
  // A peer that never answers the close frame must not keep this thread.
  deadline_.expires_after(kCloseTimeout);
  deadline_.async_wait([this](error_code failure) {
    if (!failure) hard_close();
  });
  websocket::close_reason close(code);
  if (!reason.empty()) close.reason.assign(reason.data(), std::min(reason.size(), kMaxCloseReasonBytes));
  ws_.async_close(close, [this](error_code) {
    deadline_.cancel();
    hard_close();
  });
}

void ViewerClient::Connection::publish_end(Error error) {
  outbox_.close();
  {
    const std::lock_guard lock(mutex_);
    if (!outcome_) outcome_ = Status(error);
  }
  mailbox_.close(std::move(error));
  opened_.notify_all();
}

void ViewerClient::Connection::hard_close() {
  ws_.next_layer().close();
  io_.stop();  // the WebSocket layer's own idle timer would keep run() going for seconds
}

}  // namespace strandcast
