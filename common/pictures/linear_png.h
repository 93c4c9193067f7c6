// PNG of linear light, 16 bits a colour, by libpng: for pictures that are measured. Any thread.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "common/base/result.h"

namespace strandcast {

/// Linear red, green and blue, 65,535 each for 1; top row first.
struct LinearImage {
  uint32_t width = 0;
  uint32_t height = 0;
  std::vector<uint16_t> rgb;  // (height x width x 3)

  bool operator==(const LinearImage&) const = default;
};

/// Saves a picture. BadInput for an empty one or sizes that disagree.
Status save_linear_png(const std::filesystem::path& path, const LinearImage& image);
/// Loads an untrusted file of at most 1,024 x 1,024 pixels. BadInput for what is no such PNG; errors name the
/// file.
Result<LinearImage> load_linear_png(const std::filesystem::path& path);

}  // namespace strandcast
