#include "common/base/crc32.h"

#include <array>
#include <cstring>

namespace strandcast {
namespace {

constexpr uint32_t kPolynomial = 0xEDB88320u;  // 0x04C11DB7 with its bits the other way round
constexpr size_t kSlices = 8;

/// Table k says what a byte comes to that k bytes more follow (Kounavis and Berry, "A systematic approach to
/// building high performance, software-based, CRC generators", 2005).
constexpr std::array<std::array<uint32_t, 256>, kSlices> make_tables() {
  std::array<std::array<uint32_t, 256>, kSlices> tables{};
  for (uint32_t byte = 0; byte < 256; ++byte) {
    uint32_t crc = byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1u) != 0 ? kPolynomial : 0u);
    tables[0][byte] = crc;
  }
  for (size_t k = 1; k < kSlices; ++k)
    for (size_t byte = 0; byte < 256; ++byte)
      tables[k][byte] = (tables[k - 1][byte] >> 8) ^ tables[0][tables[k - 1][byte] & 0xffu];
  return tables;
}

constexpr auto kTables = make_tables();

/// Product of two polynomials, highest coefficient last, modulo the CRC's.
uint32_t product(uint32_t a, uint32_t b) {
  uint32_t sum = 0;
  for (; a != 0; a <<= 1) {
    if ((a >> 31) != 0) sum ^= b;
    b = (b >> 1) ^ ((b & 1u) != 0 ? kPolynomial : 0u);
  }
  return sum;
}

}  // namespace

uint32_t crc32(std::span<const std::byte> bytes, uint32_t before) {
  uint32_t crc = ~before;
  size_t i = 0;
  for (; i + kSlices <= bytes.size(); i += kSlices) {
    uint64_t word = 0;
    std::memcpy(&word, bytes.data() + i, kSlices);
    word ^= crc;
    crc = 0;
    for (size_t k = 0; k < kSlices; ++k) crc ^= kTables[kSlices - 1 - k][(word >> (8 * k)) & 0xffu];
  }
  for (; i < bytes.size(); ++i)
    crc = (crc >> 8) ^ kTables[0][(crc ^ static_cast<uint32_t>(bytes[i])) & 0xffu];
  return ~crc;
}

uint32_t joined_crc32(uint32_t first, uint32_t second, uint64_t second_bytes) {
  uint32_t power = 1u << 23;  // x^8: what a byte more multiplies with
  for (; second_bytes > 0; second_bytes >>= 1) {
    if ((second_bytes & 1) != 0) first = product(first, power);
    power = product(power, power);
  }
  return first ^ second;
}

}  // namespace strandcast
