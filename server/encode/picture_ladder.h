// Quality ladder of one view: the picture classes that a viewer on a slower link gets instead. First the
// quality falls, then the rate, then the size. Pure data, any thread.
#pragma once

#include <cstdint>
#include <vector>

#include "common/pictures/picture.h"

namespace strandcast {

struct PictureStep {
  int quality = 95;            // 1..100
  uint32_t rate_divisor = 1;   // of the pictures
  uint32_t size_divisor = 1;   // of both sides
  double relative_cost = 1.0;  // bytes per second against the first step
};

/// Returns the steps, best first; `usual_quality` is one of them.
std::vector<PictureStep> make_picture_ladder(PictureCodec codec, int usual_quality);
/// Returns the first step of this quality.
size_t find_step(const std::vector<PictureStep>& ladder, int quality);

/// Returns the bits per pixel and picture that a video of this quality may take.
double video_bits_per_pixel(int quality);

}  // namespace strandcast
