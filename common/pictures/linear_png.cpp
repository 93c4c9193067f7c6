#include "common/pictures/linear_png.h"

#include <png.h>

#include <cstddef>

#include "common/base/file.h"

namespace strandcast {
namespace {

constexpr uint32_t kMostLinearSide = 1024;
constexpr uint64_t kMostLinearFileBytes = 8u << 20;
constexpr size_t kColors = 3;

/// Frees what libpng keeps between begin and finish.
struct LinearPng {
  png_image image{};
  LinearPng() { image.version = PNG_IMAGE_VERSION; }
  LinearPng(const LinearPng&) = delete;
  LinearPng& operator=(const LinearPng&) = delete;
  ~LinearPng() { png_image_free(&image); }
};

Status linear_size_fits(uint32_t width, uint32_t height) {
  if (width == 0 || height == 0 || width > kMostLinearSide || height > kMostLinearSide)
    return make_error(ErrorCode::BadInput, "{} x {} pixels are not between 1 and {} a side", width, height,
                      kMostLinearSide);
  return {};
}

}  // namespace

Status save_linear_png(const std::filesystem::path& path, const LinearImage& image) {
  if (const Status fits = linear_size_fits(image.width, image.height); !fits)
    return at(path.string(), fits.error());
  if (image.rgb.size() != size_t{image.width} * image.height * kColors)
    return at(path.string(), make_error(ErrorCode::BadInput, "size and number of colours disagree"));
  LinearPng png;
  png.image.width = image.width;
  png.image.height = image.height;
  png.image.format = PNG_FORMAT_LINEAR_Y | PNG_FORMAT_FLAG_COLOR;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(png.image);
  std::vector<std::byte> bytes(size);
  if (!png_image_write_to_memory(&png.image, bytes.data(), &size, 0, image.rgb.data(), 0, nullptr))
    return at(path.string(), make_error(ErrorCode::Internal, "cannot encode PNG ({})", png.image.message));
  bytes.resize(size);
  return save_file(path, bytes);
}

Result<LinearImage> load_linear_png(const std::filesystem::path& path) {
  ASSIGN_OR_RETURN(const auto bytes, load_file(path, kMostLinearFileBytes));
  LinearPng png;
  if (!png_image_begin_read_from_memory(&png.image, bytes.data(), bytes.size()))
    return at(path.string(), make_error(ErrorCode::BadInput, "not a PNG picture ({})", png.image.message));
  if (const Status fits = linear_size_fits(png.image.width, png.image.height); !fits)
    return at(path.string(), fits.error());
  if (png.image.format != (PNG_FORMAT_LINEAR_Y | PNG_FORMAT_FLAG_COLOR))
    return at(path.string(), make_error(ErrorCode::BadInput, "not a PNG of linear light in 16 bits"));
  LinearImage image{png.image.width, png.image.height, {}};
  image.rgb.resize(size_t{image.width} * image.height * kColors);
  if (!png_image_finish_read(&png.image, nullptr, image.rgb.data(), 0, nullptr) ||
      PNG_IMAGE_FAILED(png.image) || png.image.warning_or_error != 0)
    return at(path.string(), make_error(ErrorCode::BadInput, "damaged PNG picture ({})", png.image.message));
  return image;
}

}  // namespace strandcast
