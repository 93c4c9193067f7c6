// Files for groom tests: a folder of its own per test, the shared data, and bytes written and patched by
// hand.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/shared_data.h"

namespace strandcast::test {

/// A file that is put together number by number.
struct ByteFile {
  std::vector<std::byte> bytes;

  template <class T>
  ByteFile& add(T value) {
    bytes.resize(bytes.size() + sizeof(T));
    return patch(bytes.size() - sizeof(T), value);
  }
  template <class T>
  ByteFile& patch(size_t offset, T value) {
    std::memcpy(bytes.data() + offset, &value, sizeof(T));
    return *this;
  }
  std::string text() const { return {reinterpret_cast<const char*>(bytes.data()), bytes.size()}; }

  ByteFile& zeros(size_t count) {
    bytes.resize(bytes.size() + count);
    return *this;
  }
};

inline std::filesystem::path shared_data() {
  return STRANDCAST_SHARED_DATA;
}

}  // namespace strandcast::test

/// Skips the test where the shared data folder is not beside the checkout.
#define REQUIRE_SHARED_DATA() REQUIRE_SHARED(strandcast::test::shared_data())
