#include "server/net/proxy.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "common/base/text.h"

namespace strandcast {
namespace {

constexpr std::array<uint8_t, 12> kSignature = {0x0d, 0x0a, 0x0d, 0x0a, 0x00, 0x0d,
                                                0x0a, 0x51, 0x55, 0x49, 0x54, 0x0a};
constexpr size_t kCommandAt = 12, kFamilyAt = 13, kLengthAt = 14;
constexpr uint8_t kLocal = 0x20, kProxy = 0x21;  // version 2 in the upper half
constexpr uint8_t kTcp4 = 0x11, kTcp6 = 0x21;
constexpr size_t kPortsBytes = 4;
constexpr size_t kFieldHeadBytes = 3;  // of what a proxy adds: type, length

uint8_t byte_at(std::span<const std::byte> bytes, size_t at) {
  return static_cast<uint8_t>(bytes[at]);
}

size_t size_at(std::span<const std::byte> bytes, size_t at) {
  return size_t{byte_at(bytes, at)} << 8 | byte_at(bytes, at + 1);
}

template <class Bytes>
IpAddress address_at(std::span<const std::byte> bytes, size_t at) {
  Bytes result{};
  std::transform(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                 bytes.begin() + static_cast<std::ptrdiff_t>(at + result.size()), result.begin(),
                 [](std::byte byte) { return static_cast<uint8_t>(byte); });
  return IpAddress(result);
}

template <class Bytes>
Result<std::optional<ProxiedPeer>> take_addresses(std::span<const std::byte> bytes) {
  constexpr size_t kAddressBytes = std::tuple_size_v<Bytes>;
  size_t at = kProxyFixedBytes + 2 * kAddressBytes + kPortsBytes;
  if (bytes.size() < at) return make_error(ErrorCode::BadInput, "the PROXY header ends within its addresses");
  while (at < bytes.size()) {
    if (bytes.size() - at < kFieldHeadBytes)
      return make_error(ErrorCode::BadInput, "the PROXY header ends within a field");
    at += kFieldHeadBytes + size_at(bytes, at + 1);
    if (at > bytes.size()) return make_error(ErrorCode::BadInput, "a field of the PROXY header is too long");
  }
  return std::optional<ProxiedPeer>({address_at<Bytes>(bytes, kProxyFixedBytes),
                                     address_at<Bytes>(bytes, kProxyFixedBytes + kAddressBytes)});
}

bool is_port(std::string_view text) {
  constexpr size_t kMaxPortDigits = 5;
  return !text.empty() && text.size() <= kMaxPortDigits &&
         std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
}

/// "10.0.0.7", "10.0.0.7:1234", "::1", "[::1]" or "[::1]:1234".
std::optional<IpAddress> parse_node(std::string_view text) {
  if (!text.empty() && text.front() == '[') {
    const size_t end = text.find(']');
    if (end == std::string_view::npos) return std::nullopt;
    const std::string_view rest = text.substr(end + 1);
    if (!rest.empty() && (rest.front() != ':' || !is_port(rest.substr(1)))) return std::nullopt;
    const auto address = IpAddress::parse(text.substr(1, end - 1));
    return text.substr(1, end - 1).find(':') == std::string_view::npos ? std::nullopt : address;
  }
  const size_t colon = text.find(':');
  const bool has_port =
      colon != std::string_view::npos && text.find(':', colon + 1) == std::string_view::npos;
  if (!has_port) return IpAddress::parse(text);
  return is_port(text.substr(colon + 1)) ? IpAddress::parse(text.substr(0, colon)) : std::nullopt;
}

}  // namespace

Result<size_t> proxy_header_bytes(std::span<const std::byte> fixed) {
  const auto is_same = [](uint8_t wanted, std::byte given) { return wanted == static_cast<uint8_t>(given); };
  if (fixed.size() < kProxyFixedBytes ||
      !std::equal(kSignature.begin(), kSignature.end(), fixed.begin(), is_same))
    return make_error(ErrorCode::BadInput, "this is no PROXY header of version 2");
  const uint8_t command = byte_at(fixed, kCommandAt);
  const uint8_t family = byte_at(fixed, kFamilyAt);
  if (command != kLocal && command != kProxy)
    return make_error(ErrorCode::BadInput, "version and command {:#04x} of a PROXY header are unknown",
                      command);
  if (command == kProxy && family != kTcp4 && family != kTcp6)
    return make_error(ErrorCode::BadInput, "a PROXY header is about family {:#04x}, which is not TCP",
                      family);
  const size_t size = kProxyFixedBytes + size_at(fixed, kLengthAt);
  if (size > kMaxProxyBytes)
    return make_error(ErrorCode::LimitExceeded, "a PROXY header has {} bytes, the limit is {}", size,
                      kMaxProxyBytes);
  return size;
}

Result<std::optional<ProxiedPeer>> parse_proxy_header(std::span<const std::byte> bytes) {
  ASSIGN_OR_RETURN(const size_t size,
                   proxy_header_bytes(bytes.first(std::min(bytes.size(), kProxyFixedBytes))));
  if (bytes.size() != size)
    return make_error(ErrorCode::BadInput, "a PROXY header of {} bytes says that it has {}", bytes.size(),
                      size);
  if (byte_at(bytes, kCommandAt) == kLocal) return std::optional<ProxiedPeer>();
  return byte_at(bytes, kFamilyAt) == kTcp4 ? take_addresses<IpAddress::Bytes4>(bytes)
                                            : take_addresses<IpAddress::Bytes16>(bytes);
}

Result<IpAddress> forwarded_client(std::string_view field, const std::vector<AddressRange>& proxies) {
  for (size_t hop = 0; hop < kMaxForwardedHops; ++hop) {
    const size_t comma = field.rfind(',');
    const bool is_first = comma == std::string_view::npos;
    const auto address = parse_node(trimmed(is_first ? field : field.substr(comma + 1)));
    if (!address) return make_error(ErrorCode::BadInput, "X-Forwarded-For names no address");
    if (is_first || !is_in(proxies, *address)) return *address;
    field = field.substr(0, comma);
  }
  return make_error(ErrorCode::LimitExceeded, "X-Forwarded-For goes through more than {} proxies",
                    kMaxForwardedHops);
}

}  // namespace strandcast
