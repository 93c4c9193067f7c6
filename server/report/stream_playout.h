// StreamPlayout: measures interpolation between states. Every second state of a recording is removed, as in a
// stream of 30 states a second. The viewer's picture in its place is compared with the picture of the removed
// state. States are exact floats; StreamView measures the errors of codecs. Drawn in tiles on the processors.
#pragma once

#include <string>
#include <vector>

#include "common/base/picture_size.h"
#include "common/replay/interpolation.h"
#include "common/scene/scene_desc.h"
#include "server/report/stream_recording.h"

namespace strandcast {

struct StreamPlayoutDesc {
  RenderSize size{640, 360};
  size_t compared_pictures = 4;  // evenly spaced
  double distance_m = 0.66;
};

/// How well one interpolation shows one recording; numbers are means over the compared pictures.
struct PlayoutRow {
  std::string motion;
  std::string solver;
  Interpolation interpolation = Interpolation::None;  // None: the state before is shown
  size_t compared_pictures = 0;
  double rms_error_m = 0.0;  // of vertices, in the world
  double psnr_db = 0.0;      // in the hair's pixels
  double ssim = 0.0;
  double delta_e = 0.0;
};

/// Returns a row for each Interpolation. BadInput for a recording of fewer than seven frames.
Result<std::vector<PlayoutRow>> measure_playout(const StreamPlayoutDesc& desc, const SceneDesc& scene,
                                                const StreamRecording& recording);

}  // namespace strandcast
