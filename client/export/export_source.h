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
#include "common/groom/stated_groom.h"
#include "common/strands/scene_asset.h"
#include "common/strands/snapshot.h"

namespace strandcast {

/// What the hair's own files say of it, so that an export carries it on. A list is empty where they say
/// nothing.
struct ExportOrigin {
  std::vector<uint32_t> place;             // (strand_count) of each strand in the files
  std::vector<int32_t> id, group;          // (strand_count)
  std::vector<uint32_t> object;            // (strand_count) the curves that it belongs to, in object_name
  std::vector<std::string> object_name;    // of them
  std::vector<glm::vec2> root_uv;          // (strand_count)
  std::vector<float> width_m;              // (strand_count x vertex_count) strand after strand
  std::vector<glm::vec3> rest_position_m;  // as SceneAsset::rest_position_m, not rounded
  HairMaterial material;                   // in metres
};

/// Data that is the same for all states.
struct ExportScene {
  std::shared_ptr<const SceneAsset> asset;
  float strand_radius_m = 0.0f;                     // as drawn, at the root
  float tip_scale = 1.0f;                           // radius at the tip over radius at the root
  std::shared_ptr<ExportDrawing> drawing = {};      // of what is exported; null: the simulated strands
  std::shared_ptr<const ExportOrigin> origin = {};  // of the simulated strands; null: not known
};

/// A state's timecode.
struct CountedState {
  int64_t sim_time_ns = 0;
  Timecode timecode;
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
  /// Returns the timecode of a running server's state, from which it counts on; empty where nobody counts.
  virtual std::optional<CountedState> counted() const { return std::nullopt; }
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
