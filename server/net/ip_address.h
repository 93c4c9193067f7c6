// IpAddress and AddressRange: IPv4 and IPv6 addresses as values, parsed from untrusted text and bytes. Pure
// functions, any thread.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"

namespace strandcast {

/// An address; IPv4 in its IPv6 form (::ffff:10.0.0.7) counts as IPv4.
class IpAddress {
 public:
  using Bytes4 = std::array<uint8_t, 4>;
  using Bytes16 = std::array<uint8_t, 16>;

  IpAddress() = default;
  explicit IpAddress(const Bytes4& bytes);
  explicit IpAddress(const Bytes16& bytes) : bytes_(bytes) {}
  /// Parses a numeric address without brackets, port or zone; empty for anything else.
  static std::optional<IpAddress> parse(std::string_view text);

  std::string to_string() const;
  /// Returns the key by which addresses are counted. For IPv6 it is the 64-bit network, which is as easy to
  /// obtain as one IPv4 address.
  std::string key() const;
  bool is_v4() const;
  bool is_loopback() const;
  const Bytes16& bytes() const { return bytes_; }
  bool operator==(const IpAddress&) const = default;

 private:
  Bytes16 bytes_{};  // of IPv4 the mapped form
};

/// A range of addresses that begin with the same bits.
struct AddressRange {
  IpAddress first;
  uint32_t bit_count = 128;  // of the 16 bytes

  bool contains(const IpAddress& address) const;
};

/// Parses "10.0.0.7", "10.0.0.0/8" or "2001:db8::/32"; BadInput for anything else, including non-zero bits
/// after the prefix.
Result<AddressRange> parse_address_range(std::string_view text);

bool is_in(const std::vector<AddressRange>& ranges, const IpAddress& address);

}  // namespace strandcast
