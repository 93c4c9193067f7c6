// One HTTP GET to a server's own port, for health checks. Blocks up to the timeout.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>

#include "common/base/result.h"
#include "common/client/address.h"

namespace strandcast {

// Of an answer: whatever it contains, no more than their sum is read.
inline constexpr uint64_t kMaxHttpBodyBytes = 1u << 20;
/// The header; and the heads of chunks and the trailer of a chunked body, each by itself.
inline constexpr uint64_t kMaxHttpAnswerHeaderBytes = 16u << 10;

struct HttpAnswer {
  unsigned status = 0;
  std::string body;
};

struct HttpAccess {
  std::filesystem::path tls_authorities;  // as in ClientConfig
  std::string token;                      // sent as Authorization: Bearer when not empty
};

/// Unavailable when nobody listens or the answer is not HTTP, LimitExceeded when it is longer than the limits
/// above, Timeout when it takes too long, Unauthorized or Unsupported when TLS fails.
Result<HttpAnswer> http_get(const Address& address, const std::string& target,
                            std::chrono::milliseconds timeout, const HttpAccess& access = {});

}  // namespace strandcast
