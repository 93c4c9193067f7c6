#include "common/strands/residual_coder.h"

#include <cstring>

#include "common/base/check.h"
#include "common/strands/byte_io.h"

namespace strandcast {
namespace {

constexpr size_t kPlanes = 4;

uint32_t zig_zag(int32_t value) {
  return (static_cast<uint32_t>(value) << 1) ^ static_cast<uint32_t>(value >> 31);
}

int32_t un_zig_zag(uint32_t value) {
  return static_cast<int32_t>((value >> 1) ^ (0u - (value & 1u)));
}

}  // namespace

void PlaneEncoder::append(std::span<const int32_t> values, int level, std::vector<std::byte>& destination) {
  const size_t count = values.size();
  planes_.resize(kPlanes * count);
  for (size_t i = 0; i < count; ++i) {
    const uint32_t value = zig_zag(values[i]);
    for (size_t plane = 0; plane < kPlanes; ++plane)
      planes_[plane * count + i] = static_cast<std::byte>(value >> (8 * plane));
  }
  const size_t length_at = destination.size();
  ByteWriter(destination).put(uint32_t{0});
  zstd_.append(planes_, level, destination);
  const size_t length = destination.size() - length_at - sizeof(uint32_t);
  CHECK(length <= UINT32_MAX);
  const auto length_u32 = static_cast<uint32_t>(length);
  std::memcpy(destination.data() + length_at, &length_u32, sizeof(length_u32));
}

Result<std::span<const std::byte>> PlaneDecoder::fill(std::span<const std::byte> source,
                                                      std::span<int32_t> values) {
  ByteReader reader(source);
  const auto length = reader.take<uint32_t>();
  const auto block = reader.take_bytes(length);
  if (!reader.ok())
    return make_error(ErrorCode::BadInput, "block of {} bytes is cut off, {} bytes are left", length,
                      source.size());
  const size_t count = values.size();
  planes_.resize(kPlanes * count);
  RETURN_IF_ERROR(zstd_.fill(block, planes_));
  for (size_t i = 0; i < count; ++i) {
    uint32_t value = 0;
    for (size_t plane = 0; plane < kPlanes; ++plane)
      value |= static_cast<uint32_t>(planes_[plane * count + i]) << (8 * plane);
    values[i] = un_zig_zag(value);
  }
  return reader.rest();
}

}  // namespace strandcast
