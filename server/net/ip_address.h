// IpAddress and AddressRange: addresses of IPv4 and IPv6 as values, out of text and bytes that nobody has
// checked. Pure functions, any thread.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"

namespace strandcast {

/// IPv4 in its IPv6 form (::ffff:10.0.0.7) counts as IPv4.
class IpAddress {
 public:
  using Bytes4 = std::array<uint8_t, 4>;
  using Bytes16 = std::array<uint8_t, 16>;

  IpAddress() = default;
  explicit IpAddress(const Bytes4& bytes);
  explicit IpAddress(const Bytes16& bytes) : bytes_(bytes) {}
  /// Numeric text without brackets, port or zone; nothing for all else.
  static std::optional<IpAddress> parse(std::string_view text);

  std::string to_string() const;
  /// What counts as one address. Of IPv6 the network of 64 bits, which is as easily had as one of IPv4.
  std::string key() const;
  bool is_v4() const;
  bool is_loopback() const;
  const Bytes16& bytes() const { return bytes_; }
  bool operator==(const IpAddress&) const = default;

 private:
  Bytes16 bytes_{};  // of IPv4 the mapped form
};

/// All addresses that begin with the same bits.
struct AddressRange {
  IpAddress first;
  uint32_t bit_count = 128;  // of the 16 bytes

  bool contains(const IpAddress& address) const;
};

/// "10.0.0.7", "10.0.0.0/8" or "2001:db8::/32"; BadInput for all else, such as bits behind the count.
Result<AddressRange> parse_address_range(std::string_view text);

bool is_in(const std::vector<AddressRange>& ranges, const IpAddress& address);

}  // namespace strandcast
