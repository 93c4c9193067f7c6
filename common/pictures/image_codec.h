// Image formats: JPEG by libjpeg-turbo (picture stream), PNG by libpng (screenshots), animated WebP by
// libwebp (clips).
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "common/base/result.h"

namespace strandcast {

inline constexpr uint32_t kMaxImageSide = 8192;

/// 8-bit sRGB pixels, 4 bytes each (alpha 255), top row first.
struct Image {
  uint32_t width = 0;
  uint32_t height = 0;
  std::vector<uint8_t> rgba;  // (height x width x 4)

  bool operator==(const Image&) const = default;
};

/// Encodes a JPEG with quality 1..100, 4:2:0; alpha is dropped. BadInput for an empty image or sizes that
/// disagree, LimitExceeded above kMaxImageSide.
Result<std::vector<std::byte>> encode_jpeg(const Image& image, int quality);
struct ImageLimit {
  uint32_t width = kMaxImageSide;
  uint32_t height = kMaxImageSide;
};
/// Decodes untrusted input. The size is read from the header and checked against the limit before allocation.
/// BadInput for damaged or truncated pictures.
Result<Image> decode_jpeg(std::span<const std::byte> bytes, ImageLimit limit = {});

inline constexpr uint64_t kMaxPngFileBytes = 256ull << 20;

Status save_png(const std::filesystem::path& path, const Image& image);
/// Loads an untrusted PNG file, checked like decode_jpeg(); errors name the file.
Result<Image> load_png(const std::filesystem::path& path);

/// Writes an animated WebP picture by picture; all have the size of the first.
class ClipWriter {
 public:
  static Result<ClipWriter> make(const std::filesystem::path& path, double pictures_per_s);
  ClipWriter(ClipWriter&&) noexcept;
  ClipWriter& operator=(ClipWriter&&) noexcept;
  ~ClipWriter();
  Status add(const Image& image);
  /// Writes the file; call it once.
  Status finish();

 private:
  struct State;
  explicit ClipWriter(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace strandcast
