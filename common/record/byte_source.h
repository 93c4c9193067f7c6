// ByteSource: bytes with random access: a file, or memory in tests. One thread.
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
  /// Fills `destination` from `offset` on; BadInput if the source ends earlier.
  virtual Status read(uint64_t offset, std::span<std::byte> destination) = 0;
};

/// Opens a regular file with its present size; NotFound and BadInput name it.
Result<std::unique_ptr<ByteSource>> open_byte_source(const std::filesystem::path& path);
std::unique_ptr<ByteSource> memory_byte_source(std::vector<std::byte> bytes);

}  // namespace strandcast
