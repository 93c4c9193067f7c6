#include <cstring>

#include "common/strands/zstd_block.h"
#include "server/report/peers/integer_coder.h"

namespace strandcast {
namespace {

constexpr int kLevel = 3;

class ZstdCoder final : public IntegerCoder {
 public:
  Result<std::vector<std::byte>> encode(const IntegerPlanes& planes, IntegerKind) override {
    narrow_.resize(planes.value.size());
    for (size_t i = 0; i < narrow_.size(); ++i) {
      narrow_[i] = static_cast<int16_t>(planes.value[i]);
      if (narrow_[i] != planes.value[i])
        return make_error(ErrorCode::LimitExceeded, "{} does not fit into 16 bits", planes.value[i]);
    }
    std::vector<std::byte> bytes;
    compressor_.append(std::as_bytes(std::span(narrow_)), kLevel, bytes);
    return bytes;
  }

  Result<IntegerPlanes> decode(std::span<const std::byte> bytes, uint32_t strand_count,
                               uint32_t vertex_count) override {
    IntegerPlanes planes = IntegerPlanes::make(strand_count, vertex_count);
    decoded_.resize(planes.value.size());
    RETURN_IF_ERROR(decompressor_.fill(bytes, std::as_writable_bytes(std::span(decoded_))));
    for (size_t i = 0; i < decoded_.size(); ++i) planes.value[i] = decoded_[i];
    return planes;
  }

 private:
  ZstdCompressor compressor_;
  ZstdDecompressor decompressor_;
  std::vector<int16_t> narrow_;
  std::vector<int16_t> decoded_;
};

}  // namespace

std::unique_ptr<IntegerCoder> make_zstd_coder() {
  return std::make_unique<ZstdCoder>();
}

}  // namespace strandcast
