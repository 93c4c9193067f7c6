// FuzzInput: takes numbers and pieces off the front of a fuzzer's input. At its end come zeros and empty
// pieces.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>

// The entry of the fuzzer `name`, which is libFuzzer's in a fuzzer and one of many in the tests.
#ifdef STRANDCAST_FUZZER
#define FUZZ_ENTRY(name) LLVMFuzzerTestOneInput
#else
#define FUZZ_ENTRY(name) fuzz_##name
#endif

namespace strandcast {

class FuzzInput {
 public:
  FuzzInput(const uint8_t* data, size_t size) : rest_(std::as_bytes(std::span(data, size))) {}
  explicit FuzzInput(std::span<const std::byte> bytes) : rest_(bytes) {}

  bool is_empty() const { return rest_.empty(); }

  template <class T>
  T take() {
    static_assert(std::is_arithmetic_v<T> && !std::is_same_v<T, bool>);
    T value{};
    const auto bytes = take_bytes(sizeof(T));
    if (!bytes.empty()) std::memcpy(&value, bytes.data(), bytes.size());
    return value;
  }
  /// The next `count` bytes, or as many as are left.
  std::span<const std::byte> take_bytes(size_t count) {
    const auto taken = rest_.first(std::min(count, rest_.size()));
    rest_ = rest_.subspan(taken.size());
    return taken;
  }
  /// A piece of up to 65,535 bytes behind its length.
  std::span<const std::byte> take_piece() { return take_bytes(take<uint16_t>()); }
  /// Text up to the next line end, or to the end of the input.
  std::string take_line() {
    const auto end = std::find(rest_.begin(), rest_.end(), std::byte{'\n'});
    const auto line = take_bytes(static_cast<size_t>(end - rest_.begin()));
    (void)take_bytes(1);
    return {reinterpret_cast<const char*>(line.data()), line.size()};
  }
  std::span<const std::byte> take_rest() { return take_bytes(rest_.size()); }
  std::string take_rest_as_text() {
    const auto bytes = take_rest();
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }

 private:
  std::span<const std::byte> rest_;
};

}  // namespace strandcast
