// Connection: one TCP connection until its only HTTP request is answered or has become a Session. Network
// thread.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "server/net/beast_private.h"
#include "server/net/context_private.h"

namespace strandcast::net {

class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Context& context, tcp::socket socket);
  void start();
  /// Ends what takes too long.
  void check_deadline(int64_t time_ns);
  void abort();
  const Peer& peer() const { return peer_; }

 private:
  template <class Work>
  void guarded(Work&& work);
  void begin();
  void on_tls(const beast::error_code& error);
  void read_request();
  void on_request(const beast::error_code& error);
  void answer(const http::request<http::empty_body>& request);
  void answer_upgrade(const http::request<http::empty_body>& request);
  void refuse(http::status status, const std::string& sentence);
  void respond(http::status status, const std::string& text, const char* content_type = "text/plain");
  void answer_metrics();
  void upgrade();
  void finish();

  Context& context_;
  NetStream stream_;
  Peer peer_;
  std::string local_address_;
  bool is_loopback_ = false;
  bool is_finished_ = false;
  beast::flat_buffer buffer_{kMaxHttpReadBytes};
  std::optional<http::request_parser<http::empty_body>> parser_;
  http::response<http::string_body> response_;
};

}  // namespace strandcast::net
