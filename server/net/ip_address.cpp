#include "server/net/ip_address.h"

#include <arpa/inet.h>

#include <algorithm>
#include <charconv>

namespace strandcast {
namespace {

constexpr IpAddress::Bytes16 kMappedPrefix = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff};
constexpr size_t kMappedPrefixBytes = 12;
constexpr uint32_t kByteBits = 8;
constexpr uint8_t kLoopbackNet = 127;  // 127.0.0.0/8

/// The first `bit_count` bits, zeros behind them.
IpAddress::Bytes16 masked(const IpAddress::Bytes16& bytes, uint32_t bit_count) {
  IpAddress::Bytes16 result{};
  for (uint32_t i = 0; i < result.size(); ++i) {
    const uint32_t kept = std::min(kByteBits, bit_count - std::min(bit_count, i * kByteBits));
    result[i] = static_cast<uint8_t>(bytes[i] & (0xff00u >> kept));
  }
  return result;
}

}  // namespace

IpAddress::IpAddress(const Bytes4& bytes) : bytes_(kMappedPrefix) {
  std::copy(bytes.begin(), bytes.end(), bytes_.begin() + kMappedPrefixBytes);
}

std::optional<IpAddress> IpAddress::parse(std::string_view text) {
  if (text.size() >= INET6_ADDRSTRLEN || text.find('\0') != std::string_view::npos) return std::nullopt;
  const std::string terminated(text);
  Bytes4 four{};
  if (inet_pton(AF_INET, terminated.c_str(), four.data()) == 1) return IpAddress(four);
  Bytes16 sixteen{};
  if (inet_pton(AF_INET6, terminated.c_str(), sixteen.data()) == 1) return IpAddress(sixteen);
  return std::nullopt;
}

std::string IpAddress::to_string() const {
  std::array<char, INET6_ADDRSTRLEN> text{};
  const bool is_four = is_v4();
  const uint8_t* begin = bytes_.data() + (is_four ? kMappedPrefixBytes : 0);
  inet_ntop(is_four ? AF_INET : AF_INET6, begin, text.data(), text.size());
  return text.data();
}

std::string IpAddress::key() const {
  constexpr uint32_t kNetworkBits = 64;
  return is_v4() ? to_string() : IpAddress(masked(bytes_, kNetworkBits)).to_string() + "/64";
}

bool IpAddress::is_v4() const {
  return std::equal(bytes_.begin(), bytes_.begin() + kMappedPrefixBytes, kMappedPrefix.begin());
}

bool IpAddress::is_loopback() const {
  if (is_v4()) return bytes_[kMappedPrefixBytes] == kLoopbackNet;
  Bytes16 one{};
  one.back() = 1;
  return bytes_ == one;
}

bool AddressRange::contains(const IpAddress& address) const {
  return first.is_v4() == address.is_v4() &&
         masked(address.bytes(), bit_count) == masked(first.bytes(), bit_count);
}

Result<AddressRange> parse_address_range(std::string_view text) {
  const size_t slash = text.find('/');
  const std::optional<IpAddress> first = IpAddress::parse(text.substr(0, slash));
  if (!first)
    return make_error(ErrorCode::BadInput, "'{}' is no address or range of addresses (10.0.0.7, 10.0.0.0/8)",
                      text);
  const uint32_t own_bits = first->is_v4() ? 32 : 128;
  uint32_t bit_count = own_bits;
  if (slash != std::string_view::npos) {
    const std::string_view digits = text.substr(slash + 1);
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), bit_count);
    if (error != std::errc() || end != digits.data() + digits.size() || bit_count > own_bits)
      return make_error(ErrorCode::BadInput, "'{}': the bits behind the slash are 0..{}", text, own_bits);
  }
  const AddressRange range{*first, bit_count + 128 - own_bits};
  if (masked(first->bytes(), range.bit_count) != first->bytes())
    return make_error(ErrorCode::BadInput, "'{}' has bits set behind the first {}", text, bit_count);
  return range;
}

bool is_in(const std::vector<AddressRange>& ranges, const IpAddress& address) {
  return std::any_of(ranges.begin(), ranges.end(),
                     [&](const AddressRange& range) { return range.contains(address); });
}

}  // namespace strandcast
