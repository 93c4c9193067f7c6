// HOST:PORT as people type it, with wss:// in front for TLS and /s/NAME after it for a session of a proxy.
// Pure, any thread.
#pragma once

#include <cstdint>
#include <string>

#include "common/base/result.h"
#include "common/wire/messages.h"

namespace strandcast {

struct Address {
  std::string host = "127.0.0.1";
  uint16_t port = kDefaultPort;
  bool is_tls = false;
  std::string session = {};  // empty: the server itself

  bool operator==(const Address&) const = default;
  /// Returns HOST:PORT, or HOST:PORT/s/NAME.
  std::string to_string() const;
  /// Returns HOST:PORT.
  std::string authority() const;
  /// Returns the prefix of every path: "" or "/s/NAME".
  std::string folder() const;
};

/// Parses "host", "host:port", ":port", "[ipv6]" or "[ipv6]:port", optionally after "ws://" or "wss://" and
/// before "/s/NAME". Missing parts keep their defaults. BadInput names the text.
Result<Address> parse_address(const std::string& text);

}  // namespace strandcast
