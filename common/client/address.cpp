#include "common/client/address.h"

#include <charconv>
#include <string_view>

#include "common/wire/session_path.h"

namespace strandcast {

std::string Address::to_string() const {
  return authority() + folder();
}

std::string Address::folder() const {
  return session.empty() ? std::string() : std::string(kSessionFolder) + session;
}

std::string Address::authority() const {
  const bool is_ipv6 = host.find(':') != std::string::npos;
  return is_ipv6 ? fmt::format("[{}]:{}", host, port) : fmt::format("{}:{}", host, port);
}

Result<Address> parse_address(const std::string& typed) {
  constexpr size_t kMaxHostLength = 253;  // of a DNS name
  constexpr std::string_view kPlainScheme = "ws://", kTlsScheme = "wss://";
  const bool is_tls = typed.starts_with(kTlsScheme);
  const std::string full = typed.substr(is_tls                            ? kTlsScheme.size()
                                        : typed.starts_with(kPlainScheme) ? kPlainScheme.size()
                                                                          : 0);
  const std::string text = full.substr(0, full.find('/'));
  const auto bad = [&](const char* why) {
    return make_error(ErrorCode::BadInput,
                      "'{}' is not an address: {} (use HOST:PORT, for example 127.0.0.1:{})",
                      full.substr(0, kMaxHostLength), why, kDefaultPort);
  };
  Address address;
  address.is_tls = is_tls;
  if (std::string path = full.substr(text.size()); !path.empty() && path != "/") {
    if (path.ends_with('/')) path.pop_back();
    if (!path.starts_with(kSessionFolder) || !is_session_name(path.substr(kSessionFolder.size())))
      return bad("behind the port may stand a session only, /s/NAME");
    address.session = path.substr(kSessionFolder.size());
  }
  std::string host = text;
  std::string port;
  if (text.starts_with('[')) {
    const size_t end = text.find(']');
    if (end == std::string::npos) return bad("the bracket is not closed");
    host = text.substr(1, end - 1);
    if (end + 1 < text.size()) {
      if (text[end + 1] != ':') return bad("a colon must follow the bracket");
      port = text.substr(end + 2);
      if (port.empty()) return bad("the port is missing");
    }
  } else if (const size_t colon = text.rfind(':'); colon != std::string::npos) {
    if (text.find(':') != colon) return bad("an IPv6 host needs brackets");
    host = text.substr(0, colon);
    port = text.substr(colon + 1);
    if (port.empty()) return bad("the port is missing");
  }
  if (host.size() > kMaxHostLength) return bad("the host name is too long");
  if (host.find_first_of("[]") != std::string::npos) return bad("brackets belong around an IPv6 host only");
  if (!host.empty()) address.host = host;
  if (!port.empty()) {
    const auto [end, failure] = std::from_chars(port.data(), port.data() + port.size(), address.port);
    if (failure != std::errc() || end != port.data() + port.size() || address.port == 0)
      return bad("the port must be a number from 1 to 65535");
  }
  return address;
}

}  // namespace strandcast
