#include "client/net/http_get.h"

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <optional>

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
  Exchange(const Address& address, const std::string& target)
      : resolver_(io_), stream_(io_), request_(http::verb::get, target, 11) {
    request_.set(http::field::host, address.to_string());
    request_.set(http::field::user_agent, "strandcast");
    parser_.body_limit(kMaxHttpBodyBytes);
    resolver_.async_resolve(address.host, std::to_string(address.port),
                            [this](error_code failure, const tcp::resolver::results_type& results) {
                              if (!keep(failure)) return;
                              stream_.async_connect(results,
                                                    [this](error_code f, const tcp::endpoint&) { write(f); });
                            });
  }

  Result<HttpAnswer> run(std::chrono::milliseconds timeout) {
    stream_.expires_after(timeout);
    io_.run_for(timeout);
    if (is_done_) return HttpAnswer{parser_.get().result_int(), parser_.get().body()};
    if (failure_ && failure_ != beast::error::timeout)
      return make_error(ErrorCode::Unavailable, "no HTTP answer: {}", failure_.message());
    return make_error(ErrorCode::Timeout, "no HTTP answer within {} ms", timeout.count());
  }

 private:
  bool keep(const error_code& failure) {
    if (failure) failure_ = failure;
    return !failure;
  }

  void write(const error_code& failure) {
    if (!keep(failure)) return;
    http::async_write(stream_, request_, [this](error_code f, size_t) {
      if (!keep(f)) return;
      http::async_read(stream_, buffer_, parser_, [this](error_code g, size_t) { is_done_ = keep(g); });
    });
  }

  asio::io_context io_{1};
  tcp::resolver resolver_;
  beast::tcp_stream stream_;
  http::request<http::empty_body> request_;
  http::response_parser<http::string_body> parser_;
  beast::flat_buffer buffer_;
  error_code failure_;
  bool is_done_ = false;
};

}  // namespace

Result<HttpAnswer> http_get(const Address& address, const std::string& target,
                            std::chrono::milliseconds timeout) {
  try {
    auto answer = Exchange(address, target).run(timeout);
    if (!answer) return at(address.to_string(), answer.error());
    return answer;
  } catch (const std::exception& failure) {
    return at(address.to_string(),
              make_error(ErrorCode::Internal, "HTTP request failed: {}", failure.what()));
  }
}

}  // namespace strandcast
