// Connection: one TCP connection until its only HTTP request is answered or has become a Session. Network
// thread.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/net/beast_private.h"
#include "server/net/context_private.h"

namespace strandcast::net {

class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Context& context, tcp::socket socket);
  /// False when its address has too many connections: it is to be closed unanswered. A proxy of ours is
  /// welcome; whom it speaks for is looked at when that is known.
  bool is_welcome();
  void start();
  /// Ends what takes too long.
  void check_deadline(int64_t time_ns);
  void abort();
  const Peer& peer() const { return peer_; }

 private:
  using Request = http::request<http::empty_body>;

  template <class Work>
  void guarded(Work&& work);
  void read_proxy_header(size_t size);
  void on_proxy_header(const beast::error_code& error);
  std::optional<Refusal> stand_for(const IpAddress& client);
  void begin();
  void on_tls(const beast::error_code& error);
  void read_request();
  void on_request(const beast::error_code& error);
  bool is_fit(const Request& request);
  bool is_client_known(const Request& request);
  bool may_be_plain();
  void answer(const Request& request);
  void answer_readiness();
  void answer_metrics(const Request& request);
  void answer_upgrade(const Request& request);
  void upgrade();
  void drop(Refusal why, const std::string& sentence);
  void refuse(Refusal why, http::status status, const std::string& sentence, const std::string& detail = {});
  void respond(http::status status, const std::string& text, const char* content_type = "text/plain");
  void finish();

  Context& context_;
  NetStream stream_;
  Peer peer_;
  std::string local_address_;
  bool is_loopback_ = false;
  bool is_finished_ = false;
  std::vector<uint8_t> proxy_header_;
  beast::flat_buffer buffer_{kMaxHttpReadBytes};
  std::optional<http::request_parser<http::empty_body>> parser_;
  http::response<http::string_body> response_;
};

}  // namespace strandcast::net
