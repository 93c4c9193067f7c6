// Reasons for which a peer is refused or dropped: the word in the log and the counter in /metrics.
// SECURITY.md explains the words.
#pragma once

#include <cstdint>

#include "server/net/net_server.h"

namespace strandcast::net {

enum class Refusal {
  Full,
  Rate,
  Blocked,
  Token,
  Role,
  Tls,
  Proxy,
  Request,
  Host,
  Origin,
  Path,
  Timeout,
  Message
};

struct RefusalRow {
  const char* word;
  uint64_t NetCounters::*counter;
};

/// In the order of the enumerators.
inline constexpr RefusalRow kRefusals[] = {
    {"full", &NetCounters::refused_full},    {"rate", &NetCounters::refused_rate},
    {"blocked", &NetCounters::refused_rate}, {"token", &NetCounters::refused_token},
    {"role", &NetCounters::refused_token},   {"tls", &NetCounters::refused_tls},
    {"proxy", &NetCounters::refused_http},   {"request", &NetCounters::refused_http},
    {"host", &NetCounters::refused_http},    {"origin", &NetCounters::refused_http},
    {"path", &NetCounters::refused_http},    {"timeout", &NetCounters::timeouts},
    {"message", &NetCounters::bad_messages}};

inline const RefusalRow& row_of(Refusal why) {
  return kRefusals[static_cast<int>(why)];
}

}  // namespace strandcast::net
