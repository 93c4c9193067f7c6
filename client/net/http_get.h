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
/// Limit of the header; also of each chunk's head and of the trailer of a chunked body.
inline constexpr uint64_t kMaxHttpAnswerHeaderBytes = 16u << 10;

struct HttpAnswer {
  unsigned status = 0;
  std::string body;
};

struct HttpAccess {
  std::filesystem::path tls_authorities;  // as in ClientConfig
  std::string token;                      // sent as Authorization: Bearer when not empty
};

/// Sends the request and returns the answer. Unavailable if nobody listens or the answer is not HTTP,
/// LimitExceeded beyond the limits above, Timeout, and Unauthorized or Unsupported if TLS fails.
Result<HttpAnswer> http_get(const Address& address, const std::string& target,
                            std::chrono::milliseconds timeout, const HttpAccess& access = {});

}  // namespace strandcast
