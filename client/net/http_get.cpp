#include "client/net/http_get.h"

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <optional>

#include "common/client/connection_error_private.h"
#include "common/net/net_stream_private.h"

namespace strandcast {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using tcp = asio::ip::tcp;
using boost::system::error_code;

/// The request as a chain of completions on one thread; the io_context ends when the chain does.
class Exchange {
 public:
  Exchange(const Address& address, const std::string& target, TlsContextPtr tls, const std::string& token)
      : host_(address.host), tls_(std::move(tls)), request_(http::verb::get, address.folder() + target, 11) {
    request_.set(http::field::host, address.authority());
    request_.set(http::field::user_agent, "strandcast");
    if (!token.empty()) request_.set(http::field::authorization, "Bearer " + token);
    parser_.body_limit(kMaxHttpBodyBytes);
    parser_.header_limit(kMaxHttpAnswerHeaderBytes);
    stream_.limit_reading(kMaxHttpAnswerHeaderBytes + kMaxHttpBodyBytes);
    resolver_.async_resolve(address.host, std::to_string(address.port),
                            [this](error_code failure, const tcp::resolver::results_type& results) {
                              if (!keep(failure, "cannot find the host: ")) return;
                              connect(results);
                            });
  }

  Result<HttpAnswer> run(std::chrono::milliseconds timeout) {
    io_.run_for(timeout);
    if (is_done_) return HttpAnswer{parser_.get().result_int(), parser_.get().body()};
    if (tls_error_) return *tls_error_;
    if (failure_ && is_too_long(failure_))
      return make_error(ErrorCode::LimitExceeded,
                        "the HTTP answer is too long: more than {} bytes of header, or {} of body",
                        kMaxHttpAnswerHeaderBytes, kMaxHttpBodyBytes);
    if (failure_) return make_error(ErrorCode::Unavailable, "{}{}", what_failed_, failure_.message());
    return make_error(ErrorCode::Timeout, "no HTTP answer within {} ms", timeout.count());
  }

 private:
  bool keep(const error_code& failure, const char* what = "no HTTP answer: ") {
    if (failure) failure_ = failure;
    if (failure) what_failed_ = what;
    return !failure;
  }

  void connect(const tcp::resolver::results_type& results) {
    asio::async_connect(stream_.socket(), results, [this](error_code failure, const tcp::endpoint&) {
      if (!keep(failure, "cannot connect (is strandcast-server running?): ")) return;
      if (tls_ == nullptr) return write(failure);
      stream_.async_connect_tls(tls_, host_, [this](error_code f) {
        if (f) tls_error_ = error_from_tls(stream_, f);
        write(f);
      });
    });
  }

  void write(const error_code& failure) {
    if (!keep(failure)) return;
    http::async_write(stream_, request_, [this](error_code f, size_t) {
      if (!keep(f)) return;
      http::async_read(stream_, buffer_, parser_, [this](error_code g, size_t) { is_done_ = keep(g); });
    });
  }

  asio::io_context io_{1};
  const std::string host_;
  const TlsContextPtr tls_;
  tcp::resolver resolver_{io_};
  net::NetStream stream_{tcp::socket(io_)};
  http::request<http::empty_body> request_;
  http::response_parser<http::string_body> parser_;
  beast::flat_buffer buffer_{kMaxHttpAnswerHeaderBytes};
  error_code failure_;
  const char* what_failed_ = "";
  std::optional<Error> tls_error_;
  bool is_done_ = false;
};

}  // namespace

Result<HttpAnswer> http_get(const Address& address, const std::string& target,
                            std::chrono::milliseconds timeout, const HttpAccess& access) {
  try {
    TlsContextPtr tls;
    if (address.is_tls) {
      ASSIGN_OR_RETURN(tls, make_client_tls(access.tls_authorities));
    }
    auto answer = Exchange(address, target, std::move(tls), access.token).run(timeout);
    if (!answer) return at(address.to_string(), answer.error());
    return answer;
  } catch (const std::exception& failure) {
    return at(address.to_string(),
              make_error(ErrorCode::Internal, "HTTP request failed: {}", failure.what()));
  }
}

}  // namespace strandcast
