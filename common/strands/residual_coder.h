// Entropy coding of mostly small signed integers: zig-zag, four byte planes, zstd. Keeps no state between
// calls. One object per thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/strands/zstd_block.h"

namespace strandcast {

class PlaneEncoder {
 public:
  /// Appends a u32 length and one zstd frame.
  void append(std::span<const int32_t> values, int level, std::vector<std::byte>& destination);

 private:
  ZstdCompressor zstd_;
  std::vector<std::byte> planes_;
};

class PlaneDecoder {
 public:
  /// Reads what append() wrote from the front of untrusted `source` and fills `values`, whose size the caller
  /// knows. Returns the remaining bytes; BadInput for malformed ones.
  Result<std::span<const std::byte>> fill(std::span<const std::byte> source, std::span<int32_t> values);

 private:
  ZstdDecompressor zstd_;
  std::vector<std::byte> planes_;
};

}  // namespace strandcast
