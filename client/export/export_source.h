// ExportSource: states of strands in time order, from a running server or a recording.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/export/export_drawing.h"
#include "client/export/timecode_track.h"
#include "common/base/result.h"
#include "common/strands/scene_asset.h"
#include "common/strands/snapshot.h"

namespace strandcast {

/// Data that is the same for all states.
struct ExportScene {
  std::shared_ptr<const SceneAsset> asset;
  float strand_radius_m = 0.0f;                 // as drawn, at the root
  float tip_scale = 1.0f;                       // radius at the tip over radius at the root
  std::shared_ptr<ExportDrawing> drawing = {};  // of what is exported; null: the simulated strands
};

class ExportSource {
 public:
  virtual ~ExportSource() = default;

  virtual const ExportScene& scene() const = 0;
  /// Skips states, if possible, that frames from `from_s` after the first state on do not need. Returns the
  /// time of the first state if it is already known. Call it before next().
  virtual Result<std::optional<int64_t>> skip_to([[maybe_unused]] double from_s) {
    return std::optional<int64_t>();
  }
  /// Returns the timecode of all states; that of a running server is not known beforehand.
  virtual const TimecodeTrack& timecodes() const {
    static const TimecodeTrack kNone;
    return kNone;
  }
  /// Returns the next state; null if there are no more. Its time is later than the last one's, unless time
  /// began anew.
  virtual Result<std::shared_ptr<const Snapshot>> next() = 0;
  /// Returns remarks for a person about the states so far, for example "12 states were lost on the way".
  virtual std::vector<std::string> remarks() const = 0;
};

}  // namespace strandcast
