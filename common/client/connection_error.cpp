#include <boost/asio/error.hpp>
#include <boost/beast/http/error.hpp>

#include "common/client/connection_error_private.h"

#include "common/base/text.h"

namespace strandcast {
namespace {

ErrorCode code_for(unsigned http_status) {
  switch (http_status) {
    case 401:
    case 403:
      return ErrorCode::Unauthorized;
    case 426:
      return ErrorCode::Unsupported;
    case 404:  // to a proxy: of a session that there is not, or not yet
      return ErrorCode::NotFound;
    case 429:  // too many connections just now
      return ErrorCode::Unavailable;
    default:
      return http_status >= 500 ? ErrorCode::Unavailable : ErrorCode::BadInput;
  }
}

}  // namespace

std::string one_line(std::string_view text) {
  constexpr size_t kMaxShownChars = 200;
  return one_line(text, kMaxShownChars);
}

Error error_from_tls(const net::NetStream& stream, const net::NetStream::error_code& failure) {
  const std::string trouble = stream.certificate_trouble();
  if (!trouble.empty())
    return make_error(ErrorCode::Unauthorized,
                      "the server's certificate is not trusted: {} (--tls-ca FILE names its authority)",
                      trouble);
  if (net::NetStream::is_tls_error(failure))
    return make_error(ErrorCode::Unsupported, "no TLS with this server: {}", failure.message());
  return make_error(ErrorCode::Unavailable, "connection lost during the TLS handshake: {}",
                    failure.message());
}

bool is_too_long(const net::NetStream::error_code& failure) {
  namespace http = boost::beast::http;
  return failure == boost::asio::error::message_size || failure == http::error::header_limit ||
         failure == http::error::body_limit || failure == http::error::buffer_overflow;
}

Error error_from_http(unsigned status, std::string_view reason, std::string_view body) {
  const std::string shown_body = one_line(body);
  return make_error(code_for(status), "the server refused the connection: HTTP {} {}{}{}", status,
                    one_line(reason), shown_body.empty() ? "" : ": ", shown_body);
}

}  // namespace strandcast
