// Little-endian packing of numbers into bytes, and checked reading. Header only, any thread.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <type_traits>
#include <vector>

namespace strandcast {

static_assert(std::endian::native == std::endian::little, "byte_io.h copies numbers as they lie in memory");

/// Appends numbers to a byte vector.
class ByteWriter {
 public:
  explicit ByteWriter(std::vector<std::byte>& bytes) : bytes_(bytes) {}

  template <class T>
  void put(T value) {
    static_assert(std::is_arithmetic_v<T>);
    put_bytes(std::as_bytes(std::span(&value, 1)));
  }
  /// Appends a number in LEB128: seven bits a byte, the lowest first.
  void put_varint(uint64_t value) {
    for (; value >= 0x80; value >>= 7) bytes_.push_back(static_cast<std::byte>(value | 0x80u));
    bytes_.push_back(static_cast<std::byte>(value));
  }
  void put_bytes(std::span<const std::byte> source) {
    bytes_.insert(bytes_.end(), source.begin(), source.end());
  }

 private:
  std::vector<std::byte>& bytes_;
};

/// Reads numbers from untrusted bytes. Reading past the end gives zero and clears ok(), which the caller
/// checks afterwards.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  template <class T>
  T take() {
    static_assert(std::is_arithmetic_v<T>);
    T value{};
    const auto source = take_bytes(sizeof(T));
    if (!source.empty()) std::memcpy(&value, source.data(), sizeof(T));
    return value;
  }
  /// Takes a number in LEB128. One that T cannot hold, or that ends with an empty byte, is an error.
  template <class T>
  T take_varint() {
    static_assert(std::is_unsigned_v<T>);
    T value = 0;
    for (int shift = 0;; shift += 7) {
      const auto byte = take<uint8_t>();
      const auto bits = static_cast<T>(byte & 0x7fu);
      const bool is_lost =
          shift >= std::numeric_limits<T>::digits || static_cast<T>(bits << shift) >> shift != bits;
      if (!ok_ || is_lost || (byte == 0 && shift > 0)) break;
      value = static_cast<T>(value | static_cast<T>(bits << shift));
      if ((byte & 0x80u) == 0) return value;
    }
    take_bytes(bytes_.size() + 1);
    return 0;
  }
  /// Takes the next `count` bytes; returns an empty span if fewer are left.
  std::span<const std::byte> take_bytes(size_t count) {
    if (count > bytes_.size()) {
      ok_ = false;
      bytes_ = {};
      return {};
    }
    const auto taken = bytes_.first(count);
    bytes_ = bytes_.subspan(count);
    return taken;
  }
  bool ok() const { return ok_; }
  std::span<const std::byte> rest() const { return bytes_; }

 private:
  std::span<const std::byte> bytes_;
  bool ok_ = true;
};

}  // namespace strandcast
