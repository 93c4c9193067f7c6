#include "common/pictures/image_codec.h"

#include <png.h>
#include <turbojpeg.h>

#include <utility>

#include "common/base/file.h"
#include "common/base/picture_size.h"
#include "common/pictures/image_check.h"

namespace strandcast {
namespace {

constexpr size_t kChannels = 4;

struct FreeTurbo {
  void operator()(void* handle) const { tjDestroy(handle); }
};
using TurboHandle = std::unique_ptr<void, FreeTurbo>;

struct FreeTurboBytes {
  void operator()(unsigned char* bytes) const { tjFree(bytes); }
};

/// Frees what libpng keeps between begin and finish.
struct PngImage {
  png_image image{};
  PngImage() { image.version = PNG_IMAGE_VERSION; }
  ~PngImage() { png_image_free(&image); }
  PngImage(const PngImage&) = delete;
  PngImage& operator=(const PngImage&) = delete;
};

}  // namespace

Status check_image(const Image& image) {
  RETURN_IF_ERROR(check_image_size(image.width, image.height));
  const size_t expected = static_cast<size_t>(image.width) * image.height * kChannels;
  if (image.rgba.size() != expected)
    return make_error(ErrorCode::BadInput, "image of {} x {} holds {} bytes, expected {}", image.width,
                      image.height, image.rgba.size(), expected);
  return {};
}

Status check_image_size(uint64_t width, uint64_t height) {
  if (width == 0 || height == 0)
    return make_error(ErrorCode::BadInput, "image of {} x {} pixels is empty", width, height);
  if (width > kMaxImageSide || height > kMaxImageSide)
    return make_error(ErrorCode::LimitExceeded, "image of {} x {} pixels, the limit is {} a side", width,
                      height, kMaxImageSide);
  return {};
}

Status check_picture_size(uint64_t width, uint64_t height) {
  if (width >= kMinPictureSide && height >= kMinPictureSide && width <= kMaxPictureWidth &&
      height <= kMaxPictureHeight)
    return {};
  return make_error(ErrorCode::LimitExceeded, "a picture of {} x {}, allowed are {} to {} x {}", width,
                    height, kMinPictureSide, kMaxPictureWidth, kMaxPictureHeight);
}

Result<std::vector<std::byte>> encode_jpeg(const Image& image, int quality) {
  RETURN_IF_ERROR(check_image(image));
  if (quality < 1 || quality > 100)
    return make_error(ErrorCode::BadInput, "JPEG quality {} is not in 1..100", quality);
  const TurboHandle turbo(tjInitCompress());
  if (!turbo) return make_error(ErrorCode::Internal, "cannot start the JPEG encoder");
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const int failed =
      tjCompress2(turbo.get(), image.rgba.data(), static_cast<int>(image.width), 0,
                  static_cast<int>(image.height), TJPF_RGBA, &bytes, &size, TJSAMP_420, quality, 0);
  const std::unique_ptr<unsigned char, FreeTurboBytes> owner(bytes);
  if (failed != 0)
    return make_error(ErrorCode::Internal, "cannot encode JPEG ({})", tjGetErrorStr2(turbo.get()));
  const auto* begin = reinterpret_cast<const std::byte*>(bytes);
  return std::vector<std::byte>(begin, begin + size);
}

Result<Image> decode_jpeg(std::span<const std::byte> bytes, ImageLimit limit) {
  const TurboHandle turbo(tjInitDecompress());
  if (!turbo) return make_error(ErrorCode::Internal, "cannot start the JPEG decoder");
  const auto* source = reinterpret_cast<const unsigned char*>(bytes.data());
  int width = 0, height = 0, subsampling = 0, color_space = 0;
  if (tjDecompressHeader3(turbo.get(), source, bytes.size(), &width, &height, &subsampling, &color_space) !=
      0)
    return make_error(ErrorCode::BadInput, "not a JPEG picture ({})", tjGetErrorStr2(turbo.get()));
  if (width < 0 || height < 0)
    return make_error(ErrorCode::BadInput, "JPEG picture of {} x {}", width, height);
  Image image;
  image.width = static_cast<uint32_t>(width);
  image.height = static_cast<uint32_t>(height);
  RETURN_IF_ERROR(check_image_size(image.width, image.height));
  if (image.width > limit.width || image.height > limit.height)
    return make_error(ErrorCode::LimitExceeded, "JPEG picture of {} x {} pixels, the limit is {} x {}",
                      image.width, image.height, limit.width, limit.height);
  image.rgba.resize(static_cast<size_t>(image.width) * image.height * kChannels);
  // A picture with thousands of progressive scans, or with warnings, is not one of ours.
  const int failed = tjDecompress2(turbo.get(), source, bytes.size(), image.rgba.data(), width, 0, height,
                                   TJPF_RGBA, TJFLAG_STOPONWARNING | TJFLAG_LIMITSCANS);
  if (failed != 0)
    return make_error(ErrorCode::BadInput, "damaged JPEG picture of {} x {} ({})", width, height,
                      tjGetErrorStr2(turbo.get()));
  return image;
}

Status save_png(const std::filesystem::path& path, const Image& image) {
  if (auto valid = check_image(image); !valid) return at(path.string(), valid.error());
  PngImage png;
  png.image.width = image.width;
  png.image.height = image.height;
  png.image.format = PNG_FORMAT_RGBA;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(png.image);
  std::vector<std::byte> bytes(size);
  if (!png_image_write_to_memory(&png.image, bytes.data(), &size, 0, image.rgba.data(), 0, nullptr))
    return at(path.string(), make_error(ErrorCode::Internal, "cannot encode PNG ({})", png.image.message));
  bytes.resize(size);
  return save_file(path, bytes);
}

Result<Image> load_png(const std::filesystem::path& path) {
  ASSIGN_OR_RETURN(const auto bytes, load_file(path, kMaxPngFileBytes));
  PngImage png;
  if (!png_image_begin_read_from_memory(&png.image, bytes.data(), bytes.size()))
    return at(path.string(), make_error(ErrorCode::BadInput, "not a PNG picture ({})", png.image.message));
  if (auto valid = check_image_size(png.image.width, png.image.height); !valid)
    return at(path.string(), valid.error());
  png.image.format = PNG_FORMAT_RGBA;
  Image image;
  image.width = png.image.width;
  image.height = png.image.height;
  image.rgba.resize(PNG_IMAGE_SIZE(png.image));
  if (!png_image_finish_read(&png.image, nullptr, image.rgba.data(), 0, nullptr))
    return at(path.string(), make_error(ErrorCode::BadInput, "damaged PNG picture ({})", png.image.message));
  if (PNG_IMAGE_FAILED(png.image) || png.image.warning_or_error != 0)
    return at(path.string(), make_error(ErrorCode::BadInput, "damaged PNG picture ({})", png.image.message));
  return image;
}

}  // namespace strandcast
