// libFuzzer entry: a JPEG picture, its size checked before anything is allocated.
#include "common/base/check.h"
#include "common/pictures/image_codec.h"
#include "tests/fuzz/fuzz_input.h"

namespace strandcast::jpeg_fuzz {

extern "C" int FUZZ_ENTRY(jpeg)(const uint8_t* data, size_t size) {
  const auto image = decode_jpeg(FuzzInput(data, size).take_rest());
  if (!image) return 0;
  CHECK(image->width >= 1 && image->width <= kMaxImageSide);
  CHECK(image->height >= 1 && image->height <= kMaxImageSide);
  CHECK(image->rgba.size() == static_cast<size_t>(image->width) * image->height * 4);
  constexpr size_t kManyBytes = 1 << 18;  // more only cost time here
  if (image->rgba.size() > kManyBytes) return 0;
  const auto bytes = encode_jpeg(*image, 80);
  CHECK(bytes.ok());
  const auto again = decode_jpeg(*bytes);
  CHECK(again.ok() && again->width == image->width && again->height == image->height);
  return 0;
}

}  // namespace strandcast::jpeg_fuzz
