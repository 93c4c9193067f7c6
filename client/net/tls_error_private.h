// Why TLS with a server failed, for a person. Private to client/net.
#pragma once

#include "common/base/result.h"
#include "common/net/net_stream_private.h"

namespace strandcast {

/// Unauthorized when the certificate is not to be trusted, Unsupported when the other side speaks no TLS of
/// ours: neither goes away by trying again. Unavailable when the connection broke.
inline Error error_from_tls(const net::NetStream& stream, const net::NetStream::error_code& failure) {
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

}  // namespace strandcast
