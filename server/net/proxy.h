// Finds the client behind a proxy: the header of the PROXY protocol, version 2 (haproxy.org/download/2.9/doc/
// proxy-protocol.txt, section 2.2), and the HTTP field X-Forwarded-For. Untrusted input; pure functions, any
// thread.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "server/net/ip_address.h"

namespace strandcast {

/// Size of a header's fixed part: signature, version and command, family, length of the rest.
inline constexpr size_t kProxyFixedBytes = 16;
/// Largest whole header, with all extensions.
inline constexpr size_t kMaxProxyBytes = 2'048;
/// Largest number of chained proxies that are followed.
inline constexpr size_t kMaxForwardedHops = 16;

/// Both ends of the connection that a proxy forwards.
struct ProxiedPeer {
  IpAddress address;
  IpAddress local_address;  // what it connected to
};

/// Returns the size of the whole header that begins with these kProxyFixedBytes bytes. BadInput unless it is
/// version 2 about TCP, LimitExceeded above kMaxProxyBytes.
Result<size_t> proxy_header_bytes(std::span<const std::byte> fixed);

/// Reads the whole header; empty if the proxy speaks for itself. Extensions must be well-formed and are
/// ignored.
Result<std::optional<ProxiedPeer>> parse_proxy_header(std::span<const std::byte> bytes);

/// Returns the last address of an X-Forwarded-For field that is not one of our `proxies`: the one that our
/// outermost proxy has seen. Returns the first address if all are proxies. Earlier entries are written by the
/// client and are ignored.
Result<IpAddress> forwarded_client(std::string_view field, const std::vector<AddressRange>& proxies);

}  // namespace strandcast
