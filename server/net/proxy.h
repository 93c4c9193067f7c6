// Who stands behind a proxy: the header of the PROXY protocol, version 2 (haproxy.org/download/2.9/doc/
// proxy-protocol.txt, section 2.2), and the HTTP field X-Forwarded-For. Bytes and text that nobody has
// checked; pure functions, any thread.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "server/net/ip_address.h"

namespace strandcast {

/// What every header begins with: signature, version and command, family, length of the rest.
inline constexpr size_t kProxyFixedBytes = 16;
/// The whole header, with all that a proxy adds.
inline constexpr size_t kMaxProxyBytes = 2'048;
/// Proxies behind each other that are followed.
inline constexpr size_t kMaxForwardedHops = 16;

/// Both ends of the connection that a proxy passes on.
struct ProxiedPeer {
  IpAddress address;
  IpAddress local_address;  // what it connected to
};

/// Size of the whole header that begins with these kProxyFixedBytes bytes. BadInput when it is none of
/// version 2 about TCP, LimitExceeded above kMaxProxyBytes.
Result<size_t> proxy_header_bytes(std::span<const std::byte> fixed);

/// Of the whole header; nothing when the proxy speaks for itself. What it adds must be well-formed and is
/// ignored.
Result<std::optional<ProxiedPeer>> parse_proxy_header(std::span<const std::byte> bytes);

/// The last address of an X-Forwarded-For that is none of our `proxies`, which is the first one that a proxy
/// of ours has seen itself; the first of all when every one is a proxy of ours. What stands before it is the
/// client's own writing and is not looked at.
Result<IpAddress> forwarded_client(std::string_view field, const std::vector<AddressRange>& proxies);

}  // namespace strandcast
