// Configuration of a server's network side: address, access and limits. Plain data.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/net/tls_context.h"
#include "common/wire/messages.h"
#include "server/net/ip_address.h"
#include "server/net/page.h"
#include "server/net/roles.h"
#include "server/net/strand_class.h"

namespace strandcast {

inline constexpr uint32_t kMaxSessions = 256;
static_assert(kMaxSessions <= kMaxListedSessions);
inline constexpr uint32_t kMaxSessionsPerAddress = 64;
/// Seconds of which a session's messages may come at once, as those of a feed do when a blocked way opens.
inline constexpr double kMessagesAtOnceS = 5.0;

using SessionId = uint64_t;  // never reused by one server

/// Limits of one session; tests shorten the times.
struct NetLimits {
  uint32_t sessions = kMaxSessions;
  uint32_t sessions_per_address = kMaxSessionsPerAddress;
  int64_t handshake_ms =
      5'000;                   // TCP accept to Hello, or to another HTTP request; an answer without progress
  int64_t idle_ms = 15'000;    // nothing received, pings included
  int64_t stalled_ms = 4'500;  // no progress of one write, or a viewer's silence once an answer is due
  int64_t unused_ms = 30'000;  // an acknowledgement is due, although the client sends other things
  int64_t keyframe_interval_ms = 250;  // between keyframes asked for one session
  int64_t close_ms = 2'000;            // for Goodbye and the closing handshake
  int64_t link_interval_ms = 250;      // between two looks at a link for the choice of its mode
  int64_t link_memory_ms = 30'000;     // a capacity that was seen says nothing about the link after this long
  double messages_per_s = 1'000.0;     // per session; at once those of kMessagesAtOnceS
  // Of one address, where it is not on trusted loopback.
  double connections_per_s = 10.0;  // and as many at once
  double requests_per_s = 50.0;     // HTTP, and as many at once
  uint32_t wrong_tokens = 5;        // in wrong_token_window_ms; one more blocks
  int64_t wrong_token_window_ms = 60'000;
  int64_t wrong_token_block_ms = 60'000;    // no token is looked at from there
  uint32_t guarded_addresses = 1'024;       // remembered for this at once
  uint32_t refusal_lines_per_address = 10;  // in the log, a minute
  uint32_t refusal_lines = 300;             // of all addresses
  uint32_t session_lines = 1'200;           // about those who are in, of all
  double viewer_bytes_per_s = 0.0;          // cap of what a stream may take for one viewer; 0 = none
};

/// Whether loopback connections are trusted. LikeAllOthers suits a proxy or tunnel on this machine, through
/// which all clients seem local.
enum class LoopbackTrust { Trusted, LikeAllOthers };
/// Connections that may omit TLS when the server has a certificate.
enum class PlainAccess { TrustedLoopback, Nobody };

/// Whether trusted proxies begin each connection with a PROXY header.
enum class ProxyProtocol { None, Version2 };

struct NetConfig {
  std::string address = "127.0.0.1";  // numeric, or "localhost"
  uint16_t port = kDefaultPort;       // 0 = any free port
  int socket = -1;                    // that listens already, instead of these two; -1 = none
  std::vector<AccessToken> tokens;    // needed beyond loopback
  LoopbackTrust loopback_trust = LoopbackTrust::Trusted;
  std::optional<TlsFiles> tls;  // none: no TLS
  PlainAccess plain_access = PlainAccess::TrustedLoopback;
  std::vector<std::string>
      allowed_hosts;  // accepted in the Host header, besides the server's own address and name
  std::vector<std::string> allowed_origins;  // of web pages, besides this very server
  // Who may say for whom it connects; connections from there are never trusted for coming from loopback.
  std::vector<AddressRange> trusted_proxies;
  ProxyProtocol proxy_protocol = ProxyProtocol::None;
  NetLimits limits;
  PageFiles page;  // of constants
};

}  // namespace strandcast
