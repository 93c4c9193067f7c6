// Reads big-endian numbers from untrusted bytes. Header only, any thread.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <span>
#include <type_traits>

#include "common/strands/byte_io.h"

namespace strandcast {

/// Works like ByteReader: reading past the end gives zero and clears ok().
class BigEndianReader {
 public:
  explicit BigEndianReader(std::span<const std::byte> bytes) : reader_(bytes) {}

  template <class T>
  T take() {
    static_assert(std::is_arithmetic_v<T>);
    auto bytes = std::bit_cast<std::array<std::byte, sizeof(T)>>(reader_.take<T>());
    std::reverse(bytes.begin(), bytes.end());
    return std::bit_cast<T>(bytes);
  }
  /// Takes the next `count` bytes; empty if fewer are left.
  std::span<const std::byte> take_bytes(size_t count) { return reader_.take_bytes(count); }
  bool ok() const { return reader_.ok(); }
  std::span<const std::byte> rest() const { return reader_.rest(); }

 private:
  ByteReader reader_;
};

}  // namespace strandcast
