// WebmWriter: a film of VP8 in WebM (Matroska), picture by picture: as little of the format as players need,
// with an index of keyframes. Debian's libwebm reads only. One thread.
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
  /// Gives the file its name. Without it no file is left.
  Status finish();

 private:
  struct State;
  explicit WebmWriter(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace strandcast
