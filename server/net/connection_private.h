// Connection: one TCP connection until its last HTTP request is answered or it becomes a Session. It stays
// open after a file of the page, and ends after any other answer. Network thread.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/net/beast_private.h"
#include "server/net/context_private.h"
#include "server/net/page.h"

namespace strandcast::net {

class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Context& context, tcp::socket socket);
  /// Returns false if the address has too many connections, and the connection must be closed unanswered. A
  /// trusted proxy is accepted; its client is checked once it is known.
  bool is_welcome();
  void start();
  /// Ends the connection if it takes too long.
  void check_deadline(int64_t time_ns);
  void abort();
  const Peer& peer() const { return peer_; }
  /// Returns true if at least one request was answered and nothing of the next has arrived; closing it then
  /// costs the client little.
  bool is_idle() const;

 private:
  using Request = http::request<http::empty_body>;

  /// Runs `work`; an exception ends this connection only.
  template <class Work>
  void guarded(Work&& work) {
    try {
      work();
    } catch (const std::exception& exception) {
      log_error("net", "connection from {}: {}", peer_.address, exception.what());
      finish();
    }
  }
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
  void redirect(const std::string& target);
  void answer_metrics(const Request& request);
  void answer_upgrade(const Request& request);
  bool answer_page(const Request& request);
  void send_page_file(const Request& request, const PageFile& file);
  void write_page();
  void on_page_written(const beast::error_code& error, size_t size);
  void read_next_request();
  void note_progress(int64_t time_ns);
  bool may_ask();
  void upgrade();
  void drop(Refusal why, const std::string& sentence);
  void refuse(Refusal why, http::status status, const std::string& sentence, const std::string& detail = {});
  void respond(http::status status, const std::string& text, const char* content_type = "text/plain");
  void finish();

  Context& context_;
  NetStream stream_;
  Peer peer_;
  Peer from_;                // whoever connected; differs behind X-Forwarded-For
  std::string counted_key_;  // of the last client that a proxy's field named
  std::string local_address_;
  bool is_loopback_ = false;
  bool is_finished_ = false;
  std::vector<uint8_t> proxy_header_;
  beast::flat_buffer buffer_{kMaxHttpReadBytes};
  std::optional<http::request_parser<http::empty_body>> parser_;
  http::response<http::string_body> response_;
  http::response<http::span_body<const char>> page_response_;
  std::optional<http::response_serializer<http::span_body<const char>>> page_serializer_;
  int64_t since_ns_ = 0;     // begin of the wait for a request, or the last progress of an answer
  size_t answered_ = 0;      // files of the page
  size_t handed_bytes_ = 0;  // of them, to the kernel
  size_t noted_bytes_ = 0;   // of those, taken by the other side at since_ns_
  bool is_reading_ = false;
};

}  // namespace strandcast::net
