// WebmWriter: writes VP8 frames to a WebM (Matroska) file, with only the elements that players need and an
// index of keyframes. (Debian's libwebm can only read.) One thread.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "common/base/result.h"
#include "common/pictures/image_codec.h"

namespace strandcast {

class WebmWriter {
 public:
  struct Config {
    uint32_t width = 0, height = 0;  // pixels, as VideoConfig
    double pictures_per_s = 30.0;
    double bits_per_s = 0.0;  // 0 = enough for hair in motion at this size
  };
  static Result<WebmWriter> make(const std::filesystem::path& path, const Config& config);
  WebmWriter(WebmWriter&&) noexcept;
  WebmWriter& operator=(WebmWriter&&) = delete;
  ~WebmWriter();

  Status add(const Image& image);
  /// Renames the temporary file to its final name. Without this call no file is left.
  Status finish();

 private:
  struct State;
  explicit WebmWriter(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace strandcast
