#include "common/strands/zstd_block.h"

#include <zstd.h>

#include "common/base/check.h"

namespace strandcast {

void ZstdCompressor::Free::operator()(ZSTD_CCtx_s* context) const {
  ZSTD_freeCCtx(context);
}
void ZstdDecompressor::Free::operator()(ZSTD_DCtx_s* context) const {
  ZSTD_freeDCtx(context);
}

ZstdCompressor::ZstdCompressor() : context_(ZSTD_createCCtx()) {
  CHECK(context_ != nullptr);
}

void ZstdCompressor::append(std::span<const std::byte> source, int level,
                            std::vector<std::byte>& destination) {
  const size_t begin = destination.size();
  destination.resize(begin + ZSTD_compressBound(source.size()));
  const size_t written = ZSTD_compressCCtx(context_.get(), destination.data() + begin,
                                           destination.size() - begin, source.data(), source.size(), level);
  CHECK(!ZSTD_isError(written));
  destination.resize(begin + written);
}

ZstdDecompressor::ZstdDecompressor() : context_(ZSTD_createDCtx()) {
  CHECK(context_ != nullptr);
}

Status ZstdDecompressor::fill(std::span<const std::byte> source, std::span<std::byte> destination) {
  ASSIGN_OR_RETURN(const size_t content_bytes, zstd_content_bytes(source, destination.size()));
  if (content_bytes != destination.size())
    return make_error(ErrorCode::BadInput, "compressed block declares {} bytes, expected {}", content_bytes,
                      destination.size());
  if (ZSTD_findFrameCompressedSize(source.data(), source.size()) != source.size())
    return make_error(ErrorCode::BadInput, "compressed block is cut off or followed by other bytes");
  // Single-shot decompression uses the destination as its window, so it allocates nothing.
  const size_t written = ZSTD_decompressDCtx(context_.get(), destination.data(), destination.size(),
                                             source.data(), source.size());
  if (ZSTD_isError(written))
    // Why is not told: zstd's own reason differs between its builds.
    return make_error(ErrorCode::BadInput, "compressed block is damaged");
  if (written != destination.size())
    return make_error(ErrorCode::BadInput, "compressed block holds {} bytes, expected {}", written,
                      destination.size());
  return {};
}

Result<size_t> zstd_content_bytes(std::span<const std::byte> source, size_t limit_bytes) {
  const unsigned long long declared = ZSTD_getFrameContentSize(source.data(), source.size());
  if (declared == ZSTD_CONTENTSIZE_ERROR)
    return make_error(ErrorCode::BadInput,
                      "not a compressed block (its first bytes are no zstd frame header)");
  if (declared == ZSTD_CONTENTSIZE_UNKNOWN)
    return make_error(ErrorCode::BadInput, "compressed block does not declare its size");
  if (declared > limit_bytes)
    return make_error(ErrorCode::LimitExceeded, "compressed block declares {} bytes, the limit is {}",
                      declared, limit_bytes);
  return static_cast<size_t>(declared);
}

}  // namespace strandcast
