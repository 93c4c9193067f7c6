// HOST:PORT as people type it. Pure, any thread.
#pragma once

#include <cstdint>
#include <string>

#include "common/base/result.h"
#include "common/wire/messages.h"

namespace strandcast {

struct Address {
  std::string host = "127.0.0.1";
  uint16_t port = kDefaultPort;

  bool operator==(const Address&) const = default;
  std::string to_string() const;
};

/// Reads "host", "host:port", ":port", "[ipv6]" or "[ipv6]:port"; what is missing keeps its default. BadInput
/// names the text.
Result<Address> parse_address(const std::string& text);

}  // namespace strandcast
