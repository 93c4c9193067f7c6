// Why a connection to a server could not be made, for a person. Private to common/client and client/net.
#pragma once

#include <string>
#include <string_view>

#include "common/base/result.h"
#include "common/net/net_stream_private.h"

namespace strandcast {

/// Foreign text for one line of output, at most 200 characters of it.
std::string one_line(std::string_view text);

/// Unauthorized when the certificate is not to be trusted, Unsupported when the other side speaks no TLS of
/// ours: both are final (reconnect_policy.h). Unavailable when the connection broke.
Error error_from_tls(const net::NetStream& stream, const net::NetStream::error_code& failure);

/// Reading HTTP ended because the other side sent more than may be read.
bool is_too_long(const net::NetStream::error_code& failure);

/// The server answered the request to switch to WebSocket with this instead.
Error error_from_http(unsigned status, std::string_view reason, std::string_view body);

}  // namespace strandcast
