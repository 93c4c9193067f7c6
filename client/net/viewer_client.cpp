#include "client/net/viewer_client.h"

#include <algorithm>
#include <atomic>
#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <string_view>
#include <thread>
#include <utility>

#include "client/net/reconnect_policy.h"
#include "client/net/tls_error_private.h"
#include "common/base/log.h"
#include "common/base/profile.h"
#include "common/net/net_stream_private.h"

namespace strandcast {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using tcp = asio::ip::tcp;
using boost::system::error_code;

constexpr std::chrono::milliseconds kCloseTimeout{250};
constexpr std::chrono::milliseconds kFarewellTimeout{1000};  // from Goodbye to the close frame
constexpr size_t kMaxCloseReasonBytes =
    123;  // RFC 6455, section 5.5: control frames carry 125 bytes, 2 are the code
constexpr size_t kMaxOutstandingPings = 32;

/// Foreign text for one line of output: printable ASCII only, and short.
std::string printable(std::string_view text) {
  constexpr size_t kMaxShown = 200;
  std::string shown(text.substr(0, kMaxShown));
  std::replace_if(
      shown.begin(), shown.end(), [](char c) { return c < ' ' || c > '~'; }, ' ');
  return shown;
}

/// Why the server refused to switch to WebSocket.
Error error_from_http(const websocket::response_type& response) {
  ErrorCode code = ErrorCode::BadInput;
  switch (response.result_int()) {
    case 401:
    case 403:
      code = ErrorCode::Unauthorized;
      break;
    case 426:
      code = ErrorCode::Unsupported;
      break;
    case 429:
    case 503:
      code = ErrorCode::LimitExceeded;
      break;
    default:
      break;
  }
  const std::string body = printable(response.body());
  return make_error(code, "the server refused the connection: HTTP {} {}{}{}", response.result_int(),
                    printable(std::string_view(response.reason().data(), response.reason().size())),
                    body.empty() ? "" : ": ", body);
}

}  // namespace

// Everything but the members under mutex_ and mailbox_ belongs to the network thread.
class ViewerClient::Connection {
 public:
  Connection(const ClientConfig& config, TlsContextPtr tls)
      : config_(config),
        tls_(std::move(tls)),
        resolver_(io_),
        ws_(net::NetStream(tcp::socket(io_))),
        deadline_(io_),
        ping_timer_(io_),
        mailbox_(config.mailbox) {}

  ~Connection() {
    if (!thread_.joinable()) return;
    asio::post(io_, [this] {
      finish(make_error(ErrorCode::Unavailable, "closed by the application"), websocket::close_code::normal);
    });
    thread_.join();
  }

  /// Runs until the Welcome or the first error.
  Status open() {
    asio::post(io_, [this] { resolve(); });
    thread_ = std::thread([this] { run(); });
    std::unique_lock lock(mutex_);
    opened_.wait(lock, [this] { return outcome_.has_value(); });
    return *outcome_;
  }

  Status send(std::vector<std::byte> message) {
    {
      const std::lock_guard lock(mutex_);
      if (is_over_) return make_error(ErrorCode::Unavailable, "the connection is closed");
      if (outbound_.size() >= kMaxSendQueueMessages || outbound_bytes_ + message.size() > kMaxSendQueueBytes)
        return make_error(ErrorCode::LimitExceeded, "{} messages ({} bytes) wait to be sent already",
                          outbound_.size(), outbound_bytes_);
      outbound_bytes_ += message.size();
      outbound_.push_back(std::move(message));
    }
    asio::post(io_, [this] { write_next(); });
    return {};
  }

  void request_keyframe() {
    {
      const std::lock_guard lock(mutex_);
      const auto now = std::chrono::steady_clock::now();
      if (last_keyframe_request_ && now - *last_keyframe_request_ < kKeyframeRequestInterval) return;
      last_keyframe_request_ = now;
    }
    // A full send queue means the server is not reading: asking again later is all that can be done.
    if (auto sent = send(encode(ClientMessage(KeyframeRequest{}))); !sent)
      log_debug("net", "keyframe request not sent: {}", sent.error().to_string());
  }

  size_t queued_messages() const {
    const std::lock_guard lock(mutex_);
    return outbound_.size();
  }

  ClockOffset clock() const {
    const std::lock_guard lock(mutex_);
    return clock_;
  }

  ConnectionCounters counters() const {
    const std::lock_guard lock(mutex_);
    ConnectionCounters counters = counters_;
    counters.dropped_strand_frames = mailbox_.dropped_strand_frames();
    return counters;
  }

  Mailbox& mailbox() { return mailbox_; }
  const Welcome& welcome() const { return welcome_; }

 private:
  void run() {
    try {
      io_.run();
    } catch (const std::exception& failure) {
      is_finished_ = true;
      publish_end(make_error(ErrorCode::Internal, "the network thread failed: {}", failure.what()));
    }
  }

  std::string place() const { return config_.address.to_string(); }

  // ---- opening: name, TCP, WebSocket, Hello ----

  void resolve() {
    set_deadline(config_.connect_timeout, "did not answer");
    resolver_.async_resolve(config_.address.host, std::to_string(config_.address.port),
                            [this](error_code failure, const tcp::resolver::results_type& results) {
                              if (is_finished_) return;
                              if (failure)
                                return finish(make_error(ErrorCode::Unavailable, "cannot find host '{}': {}",
                                                         printable(config_.address.host), failure.message()));
                              connect_tcp(results);
                            });
  }

  void connect_tcp(const tcp::resolver::results_type& results) {
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

  void connect_tls() {
    ws_.next_layer().async_connect_tls(tls_, config_.address.host, [this](error_code failure) {
      if (is_finished_) return;
      if (failure) return finish(error_from_tls(ws_.next_layer(), failure));
      upgrade();
    });
  }

  void upgrade() {
    websocket::stream_base::timeout timeout{};
    timeout.handshake_timeout = config_.connect_timeout;
    timeout.idle_timeout = config_.idle_timeout;
    timeout.keep_alive_pings = true;
    ws_.set_option(timeout);
    ws_.set_option(websocket::stream_base::decorator([](websocket::request_type& request) {
      request.set(http::field::sec_websocket_protocol, kWebSocketProtocol);
      request.set(http::field::user_agent, "strandcast");
    }));
    ws_.read_message_max(kFrameHeaderBytes + kMaxMediaPayloadBytes);
    ws_.binary(true);
    ws_.async_handshake(response_, place(), config_.path, [this](error_code failure) {
      if (is_finished_) return;
      if (failure == websocket::error::upgrade_declined) return finish(error_from_http(response_));
      if (failure)
        return finish(
            make_error(ErrorCode::BadInput, "the WebSocket handshake failed: {}", failure.message()));
      greet();
    });
  }

  void greet() {
    is_open_ = true;
    const auto chosen = response_[http::field::sec_websocket_protocol];
    if (chosen != kWebSocketProtocol)
      return finish(
          make_error(ErrorCode::Unsupported, "the server speaks protocol '{}', this program needs '{}'",
                     printable(std::string_view(chosen.data(), chosen.size())), kWebSocketProtocol));
    set_deadline(config_.welcome_timeout, "sent no Welcome");
    if (auto sent = send(encode(ClientMessage(config_.hello))); !sent) return finish(sent.error());
    read_next();
  }

  void set_deadline(std::chrono::milliseconds timeout, const char* complaint) {
    deadline_.expires_after(timeout);
    deadline_.async_wait([this, timeout, complaint](error_code failure) {
      if (failure || is_finished_) return;
      finish(make_error(ErrorCode::Timeout, "the server {} for {} ms", complaint, timeout.count()));
    });
  }

  // ---- reading ----

  void read_next() {
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

  Error error_from_stream(const error_code& failure) {
    const auto& close = ws_.reason();
    const std::string reason =
        goodbye_.empty() ? printable(std::string_view(close.reason.data(), close.reason.size())) : goodbye_;
    if (failure == websocket::error::closed) return error_from_close(close.code, reason);
    if (!goodbye_.empty()) return error_from_close(0, reason);
    // Beast tells one of what was under way that the time is over, maybe its own ping, and aborts the others.
    if (failure == beast::error::timeout || failure == asio::error::operation_aborted)
      return make_error(ErrorCode::Timeout, "nothing received for {} ms", config_.idle_timeout.count());
    if (failure == websocket::error::message_too_big || failure == websocket::error::buffer_overflow)
      return make_error(ErrorCode::BadInput, "the server sent a message of more than {} bytes",
                        kFrameHeaderBytes + kMaxMediaPayloadBytes);
    const bool is_protocol = failure.category() == error_code(websocket::error::closed).category();
    return make_error(is_protocol ? ErrorCode::BadInput : ErrorCode::Unavailable, "connection lost: {}",
                      failure.message());
  }

  static websocket::close_code close_code_for(const Error& error) {
    return error.code == ErrorCode::BadInput || error.code == ErrorCode::LimitExceeded
               ? websocket::close_code::protocol_error
               : websocket::close_code::normal;
  }

  Status handle(std::span<const std::byte> bytes) {
    {
      const std::lock_guard lock(mutex_);
      counters_.received_bytes += bytes.size();
      ++counters_.received_messages;
    }
    if (!ws_.got_binary()) return make_error(ErrorCode::BadInput, "the server sent a text message");
    if (bytes.empty()) return make_error(ErrorCode::BadInput, "the server sent an empty message");
    if (static_cast<Opcode>(bytes[0]) == Opcode::Control) {
      ASSIGN_OR_RETURN(ServerMessage message, decode_server_message(bytes));
      if (!is_welcome_ && !may_come_first(message))
        return make_error(ErrorCode::BadInput, "the server sent something else before its Welcome");
      return std::visit([this](auto& part) { return handle_control(part); }, message);
    }
    ASSIGN_OR_RETURN(const FrameHeader header, unpack_frame_header(bytes));
    if (!is_welcome_) return make_error(ErrorCode::BadInput, "the server sent media before its Welcome");
    MediaEvent event{header, {bytes.begin(), bytes.end()}, now_ns()};
    if (mailbox_.push(std::move(event)) == Mailbox::Outcome::KeyframeNeeded) request_keyframe();
    return {};
  }

  /// A Pong that answers no ping of ours is ignored at any time.
  static bool may_come_first(const ServerMessage& message) {
    return std::holds_alternative<Welcome>(message) || std::holds_alternative<Goodbye>(message) ||
           std::holds_alternative<Pong>(message);
  }

  Status handle_control(Welcome& welcome) {
    if (is_welcome_) return make_error(ErrorCode::BadInput, "the server sent a second Welcome");
    is_welcome_ = true;
    deadline_.cancel();
    welcome_ = std::move(welcome);
    ping_next();
    {
      const std::lock_guard lock(mutex_);
      outcome_ = Status();
    }
    opened_.notify_all();
    return {};
  }

  Status handle_control(Goodbye& goodbye) {
    // The close code that follows says whether to come back; a server that sends none gets no more patience.
    goodbye_ = printable(goodbye.reason);
    if (goodbye_.empty()) goodbye_ = "no reason given";
    deadline_.expires_after(kFarewellTimeout);
    deadline_.async_wait([this](error_code failure) {
      if (!failure && !is_finished_) finish(error_from_close(0, goodbye_));
    });
    return {};
  }

  Status handle_control(Pong& pong) {
    // Only answers to our own probes count, so a server cannot feed the clock made-up round trips.
    const auto sent = std::find(outstanding_pings_.begin(), outstanding_pings_.end(), pong.client_time_ns);
    if (sent == outstanding_pings_.end()) return {};
    outstanding_pings_.erase(sent);
    const std::lock_guard lock(mutex_);
    clock_.add(pong.client_time_ns, pong.server_receive_ns, pong.server_send_ns, now_ns());
    return {};
  }

  Status handle_control(ServerStatus& status) {
    mailbox_.push(status);
    return {};
  }

  Status handle_control(StreamQuality& quality) {
    quality.reason = printable(quality.reason);
    mailbox_.push(quality);
    return {};
  }

  Status handle_control(SessionList& list) {
    for (SessionInfo& session : list.sessions) session.name = printable(session.name);
    mailbox_.push(list);
    return {};
  }

  Status handle_control(ModeChange& change) {
    change.reason = printable(change.reason);
    mailbox_.push(change);
    return {};
  }

  Status handle_control(FrameQuality& quality) {
    quality.reason = printable(quality.reason);
    mailbox_.push(quality);
    return {};
  }

  Status handle_control(Notice& notice) {
    notice.text = printable(notice.text);
    mailbox_.push(std::move(notice));
    return {};
  }

  // ---- writing ----

  void write_next() {
    if (is_writing_ || !is_open_ || is_finished_) return;
    {
      const std::lock_guard lock(mutex_);
      if (outbound_.empty()) return;
      writing_ = std::move(outbound_.front());  // its slot stays until written, so that the bound holds
    }
    is_writing_ = true;
    ws_.async_write(asio::buffer(writing_), [this](error_code failure, size_t) {
      is_writing_ = false;
      {
        const std::lock_guard lock(mutex_);
        outbound_bytes_ -= writing_.size();
        outbound_.pop_front();
        ++counters_.sent_messages;
      }
      if (is_finished_) return;
      // Whichever comes first, the read or a write, is told that the time is over.
      if (failure) return finish(error_from_stream(failure));
      write_next();
    });
  }

  void ping_next() {
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

  void finish(Error error, websocket::close_code code = websocket::close_code::normal) {
    if (is_finished_) return;
    is_finished_ = true;
    ping_timer_.cancel();
    resolver_.cancel();
    error = at(place(), std::move(error));
    const std::string reason = code == websocket::close_code::normal ? "" : error.message;
    publish_end(std::move(error));
    deadline_.cancel();
    if (!is_open_ || !ws_.is_open()) return hard_close();
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

  void publish_end(Error error) {
    {
      const std::lock_guard lock(mutex_);
      is_over_ = true;
      if (!outcome_) outcome_ = Status(error);
    }
    mailbox_.close(std::move(error));
    opened_.notify_all();
  }

  void hard_close() {
    ws_.next_layer().close();
    io_.stop();  // the WebSocket layer's own idle timer would keep run() going for seconds
  }

  const ClientConfig config_;
  const TlsContextPtr tls_;  // null: no TLS
  asio::io_context io_{1};
  tcp::resolver resolver_;
  websocket::stream<net::NetStream> ws_;
  asio::steady_timer deadline_;
  asio::steady_timer ping_timer_;
  websocket::response_type response_;
  beast::flat_buffer buffer_;
  std::vector<std::byte> writing_;
  std::deque<int64_t> outstanding_pings_;
  int ping_count_ = 0;
  bool is_open_ = false;  // the WebSocket handshake is done
  bool is_welcome_ = false;
  bool is_writing_ = false;
  bool is_finished_ = false;
  std::string goodbye_;  // the server's last sentence
  Welcome welcome_;      // written before outcome_, read after it
  Mailbox mailbox_;

  mutable std::mutex mutex_;
  std::condition_variable opened_;
  std::optional<Status> outcome_;
  bool is_over_ = false;
  std::deque<std::vector<std::byte>> outbound_;
  size_t outbound_bytes_ = 0;
  ClockOffset clock_;
  ConnectionCounters counters_;
  std::optional<std::chrono::steady_clock::time_point> last_keyframe_request_;
  std::thread thread_;
};

Result<std::unique_ptr<ViewerClient>> ViewerClient::connect(const ClientConfig& config) {
  TlsContextPtr tls;
  if (config.address.is_tls) {
    ASSIGN_OR_RETURN(tls, make_client_tls(config.tls_authorities));
  }
  auto connection = std::make_unique<Connection>(config, std::move(tls));
  RETURN_IF_ERROR(connection->open());
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
ConnectionCounters ViewerClient::counters() const {
  return connection_->counters();
}

}  // namespace strandcast
