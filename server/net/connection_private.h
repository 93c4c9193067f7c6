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
  void abort();
  const std::string& peer_address() const { return peer_address_; }

 private:
  void on_request(const beast::error_code& error);
  void respond(http::status status, const std::string& text, const char* content_type = "text/plain");
  void answer_metrics();
  void upgrade();
  void finish();

  Context& context_;
  beast::tcp_stream stream_;
  std::string peer_address_;
  std::string local_address_;
  bool is_loopback_ = false;
  bool is_finished_ = false;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::empty_body>> parser_;
  http::response<http::string_body> response_;
};

}  // namespace strandcast::net
