// Gathers the inputs of ModePolicy from the places that measure them, and states guesses for what nobody has
// measured yet. Pure arithmetic, any thread.
#pragma once

#include <string>
#include <vector>

#include "server/app/mode_policy.h"
#include "server/encode/frame_worker.h"
#include "server/net/net_handler.h"

namespace strandcast {

struct ModeSources {
  const std::vector<StrandClass>& strand_classes;
  const LinkState& link;
  ViewerReport report;
  FrameCounters pictures;
  std::string paint_trouble;      // why no pictures can be drawn; empty = they can
  bool is_software = false;       // the server draws on processor cores
  RenderSize picture_size;        // of this viewer
  size_t view_count = 1;          // that the server would draw, this viewer's included
  double picture_rate_hz = 15.0;  // at most
};

/// Guesses used before the first picture: time to draw it per pixel, and its bytes, both measured with the
/// built-in scene.
inline constexpr double kGuessedSoftwareMsPerPixel = 60.0 / (640.0 * 360.0);
inline constexpr double kGuessedHardwareMs = 10.0;
inline constexpr double kGuessedBytesPerPixel = 0.15;

ModeFacts gather_mode_facts(const ModeSources& sources);

}  // namespace strandcast
