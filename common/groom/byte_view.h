// ByteView: reads little-endian numbers and arrays from a file's bytes. Offsets and counts come from the file
// and are untrusted, so call has() before get(). Any thread.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "common/base/check.h"

namespace strandcast {

static_assert(std::endian::native == std::endian::little, "groom files are little-endian and read in place");

class ByteView {
 public:
  explicit ByteView(std::span<const std::byte> bytes) : bytes_(bytes) {}
  uint64_t size_bytes() const { return bytes_.size(); }

  /// Returns whether `count` items of `item_bytes`, starting at `offset`, lie inside the file.
  bool has(uint64_t offset, uint64_t count, uint64_t item_bytes) const {
    if (offset > bytes_.size()) return false;
    return count <= (bytes_.size() - offset) / item_bytes;
  }

  /// Reads the number at `offset`, unaligned; has(offset, 1, sizeof(T)) must be true.
  template <class T>
  T get(uint64_t offset) const {
    CHECK(has(offset, 1, sizeof(T)));
    T value;
    std::memcpy(&value, bytes_.data() + offset, sizeof(T));
    return value;
  }

 private:
  std::span<const std::byte> bytes_;
};

}  // namespace strandcast
