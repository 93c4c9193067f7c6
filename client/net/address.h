// HOST:PORT as people type it, with wss:// in front for TLS. Pure, any thread.
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

  bool operator==(const Address&) const = default;
  /// HOST:PORT.
  std::string to_string() const;
};

/// Reads "host", "host:port", ":port", "[ipv6]" or "[ipv6]:port", after "ws://" or "wss://" if any; what is
/// missing keeps its default. BadInput names the text.
Result<Address> parse_address(const std::string& text);

}  // namespace strandcast
