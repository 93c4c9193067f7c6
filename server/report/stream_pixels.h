// What pictures take: a clip of pictures through every picture codec of the project that this build has, at
// settings from coarse to fine. Any thread.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/pictures/picture_error.h"
#include "server/report/stream_view.h"

namespace strandcast {

/// One distance; what it points to outlives it.
struct PixelClip {
  double distance_m = 0.0;
  const std::vector<Image>* picture = nullptr;     // of every frame, 60 a second
  const std::vector<size_t>* compared = nullptr;   // ascending
  const std::vector<PictureMask>* hair = nullptr;  // of those
};

/// How often measure_pixels() says what it does, at most.
uint32_t pixel_step_count();
/// Bytes leave out the first kStartFrames pictures and the last, as those of strands do.
Result<std::vector<PixelPoint>> measure_pixels(
    const PixelClip& clip, const std::function<void(const std::string& doing)>& on_progress);

/// By name, those that this build or machine cannot encode.
std::vector<std::string> missing_picture_codecs();

/// Of so many frames' bytes, 60 frames a second.
double stream_mbit_per_s(double bytes, size_t frames);

}  // namespace strandcast
