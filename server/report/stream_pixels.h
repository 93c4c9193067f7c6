// Cost of streaming pictures: a clip through every picture codec of this build, at settings from coarse to
// fine. Any thread.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/pictures/picture_error.h"
#include "server/report/stream_view.h"

namespace strandcast {

/// A clip at one distance; the data that it points to must outlive it.
struct PixelClip {
  double distance_m = 0.0;
  const std::vector<Image>* picture = nullptr;     // of every frame, 60 a second
  const std::vector<size_t>* compared = nullptr;   // ascending
  const std::vector<PictureMask>* hair = nullptr;  // of those
};

/// Returns how often measure_pixels() reports progress, at most.
uint32_t pixel_step_count();
/// Measures the clip. Byte counts exclude the first kStartFrames pictures and the last, as those of strands
/// do.
Result<std::vector<PixelPoint>> measure_pixels(
    const PixelClip& clip, const std::function<void(const std::string& doing)>& on_progress);

/// Returns the names of picture codecs that this build or machine cannot encode.
std::vector<std::string> missing_picture_codecs();

/// Returns the bit rate of `frames` frames with these bytes at 60 frames a second.
double stream_mbit_per_s(double bytes, size_t frames);

}  // namespace strandcast
