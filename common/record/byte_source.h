// ByteSource: bytes that are read in any order: a file, or memory in tests. One thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "common/base/result.h"

namespace strandcast {

class ByteSource {
 public:
  virtual ~ByteSource() = default;
  virtual uint64_t size_bytes() const = 0;
  /// Fills `destination` from `offset` on. BadInput when the source ends before.
  virtual Status read(uint64_t offset, std::span<std::byte> destination) = 0;
};

/// A regular file; its size is that of now. NotFound or BadInput name it.
Result<std::unique_ptr<ByteSource>> open_byte_source(const std::filesystem::path& path);
std::unique_ptr<ByteSource> memory_byte_source(std::vector<std::byte> bytes);

}  // namespace strandcast
