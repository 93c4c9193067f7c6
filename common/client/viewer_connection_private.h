// ViewerClient::Connection: the WebSocket connection behind a ViewerClient, from the name of the server to
// the end. Everything but the public functions, the outbox, the mailbox and what mutex_ guards belongs to its
// own network thread.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "common/client/viewer_client.h"
#include "common/net/net_stream_private.h"

namespace strandcast {

/// Largest WebSocket message from the server, and largest size of the buffer that receives it.
inline constexpr size_t kMaxMessageBytes = kFrameHeaderBytes + kMaxMediaPayloadBytes;

/// Connections that are begun one beside the other, each kDoubtedServer after the one before, until one is
/// let in.
inline constexpr size_t kMostBeside = 4;

class ViewerClient::Connection {
 public:
  /// Blocks as ViewerClient::connect() does.
  static Result<std::unique_ptr<Connection>> open(const ClientConfig& config, const TlsContextPtr& tls);

  Connection(const ClientConfig& config, TlsContextPtr tls);
  ~Connection();

  void begin();
  /// Waits for the Welcome or the first error; nothing when neither has come within `timeout`.
  std::optional<Status> outcome(std::chrono::milliseconds timeout);
  Status send(std::vector<std::byte> message);
  void request_keyframe();
  size_t queued_messages() const { return outbox_.message_count(); }
  ClockOffset clock() const;
  ConnectionCounters counters() const;
  int64_t heard_ns() const { return ws_.next_layer().received_ns(); }
  Mailbox& mailbox() { return mailbox_; }
  const Welcome& welcome() const { return welcome_; }

 private:
  using error_code = boost::system::error_code;
  using tcp = boost::asio::ip::tcp;

  void run();
  void set_deadline(std::chrono::milliseconds timeout, const char* complaint);

  void note_step(ConnectStep step) const;
  void resolve();
  void connect_tcp(const tcp::resolver::results_type& results);
  void connect_tls();
  void upgrade();
  void greet();
  Hello hello() const;

  void read_next();
  Error error_from_stream(const error_code& failure);
  Status handle(std::span<const std::byte> bytes);
  Status leave_out();
  Status handle_control(Welcome& welcome);
  Status handle_control(Goodbye& goodbye);
  Status handle_control(Pong& pong);
  template <class Event>
  Status handle_control(Event& event);

  void write_next();
  void ping_next();

  void finish(Error error,
              boost::beast::websocket::close_code code = boost::beast::websocket::close_code::normal);
  void publish_end(Error error);
  void hard_close();

  const ClientConfig config_;
  const TlsContextPtr tls_;  // null: no TLS
  boost::asio::io_context io_{1};
  tcp::resolver resolver_;
  boost::beast::websocket::stream<net::NetStream> ws_;
  boost::asio::steady_timer deadline_;
  boost::asio::steady_timer ping_timer_;
  boost::beast::websocket::response_type response_;
  boost::beast::flat_buffer buffer_{kMaxMessageBytes};
  std::deque<int64_t> outstanding_pings_;
  int ping_count_ = 0;
  bool is_open_ = false;  // the WebSocket handshake is done
  bool is_welcome_ = false;
  bool is_writing_ = false;
  bool is_finished_ = false;
  std::string goodbye_;  // the server's last sentence
  Welcome welcome_;      // written before outcome_, read after it
  Mailbox mailbox_;
  Outbox outbox_;

  mutable std::mutex mutex_;
  std::condition_variable opened_;
  std::optional<Status> outcome_;
  ClockOffset clock_;
  ConnectionCounters counters_;
  std::optional<std::chrono::steady_clock::time_point> last_keyframe_request_;
  std::thread thread_;
};

}  // namespace strandcast
