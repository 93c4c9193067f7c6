// libFuzzer entry: scene assets, frame headers and JPEG pictures.
#include <span>

#include "common/base/check.h"
#include "common/codec/frame_header.h"
#include "common/codec/image_codec.h"
#include "common/codec/scene_asset.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace strandcast;
  const auto bytes = std::as_bytes(std::span(data, size));
  if (const auto header = unpack_frame_header(bytes))
    CHECK(header->payload_bytes == size - kFrameHeaderBytes);
  if (const auto asset = decode_scene_asset(bytes)) {
    CHECK(asset->rest_position_m.size() == static_cast<size_t>(asset->strand_count) * asset->vertex_count);
    for (const RootTriangle& triangle : asset->triangle)
      for (int i = 0; i < 3; ++i) CHECK(triangle[i] < asset->strand_count);
  }
  if (const auto image = decode_jpeg(bytes))
    CHECK(image->rgba.size() == static_cast<size_t>(image->width) * image->height * 4);
  return 0;
}
