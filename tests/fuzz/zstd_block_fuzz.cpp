// libFuzzer entry: one compressed block, and the byte planes inside one. The first two bytes are the size
// that the reader expects.
#include <algorithm>

#include "common/base/check.h"
#include "common/strands/residual_coder.h"
#include "common/strands/zstd_block.h"
#include "tests/fuzz/fuzz_input.h"

namespace strandcast::zstd_block_fuzz {

extern "C" int FUZZ_ENTRY(zstd_block)(const uint8_t* data, size_t size) {
  FuzzInput input(data, size);
  const size_t expected_bytes = input.take<uint16_t>();
  const auto source = input.take_rest();
  static ZstdCompressor compressor;  // making one takes longer than all the rest
  static ZstdDecompressor decompressor;

  std::vector<std::byte> content(expected_bytes);
  if (decompressor.fill(source, content)) {
    const auto declared = zstd_content_bytes(source, expected_bytes);
    CHECK(declared.ok() && *declared == expected_bytes);
  }
  std::vector<std::byte> packed;
  compressor.append(source, 1, packed);
  std::vector<std::byte> unpacked(source.size());
  CHECK(decompressor.fill(packed, unpacked).ok());
  CHECK(std::equal(source.begin(), source.end(), unpacked.begin()));

  std::vector<int32_t> values(expected_bytes / sizeof(int32_t));
  static PlaneEncoder plane_encoder;
  static PlaneDecoder plane_decoder;
  if (const auto rest = plane_decoder.fill(source, values)) {
    CHECK(rest->size() < source.size());
    std::vector<std::byte> planes;
    plane_encoder.append(values, 1, planes);
    std::vector<int32_t> again(values.size());
    const auto left = plane_decoder.fill(planes, again);
    CHECK(left.ok() && left->empty() && again == values);
  }
  return 0;
}

}  // namespace strandcast::zstd_block_fuzz
