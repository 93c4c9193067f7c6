// One zstd frame in memory, compressed and decompressed in one call. A block to decompress is untrusted: it
// must declare its size, and that size must be the expected one, before anything else happens. One object per
// thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/base/result.h"

struct ZSTD_CCtx_s;
struct ZSTD_DCtx_s;

namespace strandcast {

class ZstdCompressor {
 public:
  ZstdCompressor();
  /// Appends one frame with its content size.
  void append(std::span<const std::byte> source, int level, std::vector<std::byte>& destination);

 private:
  struct Free {
    void operator()(ZSTD_CCtx_s* context) const;
  };
  std::unique_ptr<ZSTD_CCtx_s, Free> context_;
};

class ZstdDecompressor {
 public:
  ZstdDecompressor();
  /// Decompresses `source`, which must be exactly one frame that fills `destination` exactly; else BadInput.
  Status fill(std::span<const std::byte> source, std::span<std::byte> destination);

 private:
  struct Free {
    void operator()(ZSTD_DCtx_s* context) const;
  };
  std::unique_ptr<ZSTD_DCtx_s, Free> context_;
};

/// Returns the declared content size of a frame. BadInput if it is absent or not a zstd frame, LimitExceeded
/// above the limit.
Result<size_t> zstd_content_bytes(std::span<const std::byte> source, size_t limit_bytes);

}  // namespace strandcast
