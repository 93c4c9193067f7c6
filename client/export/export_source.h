// ExportSource: states of strands in the order of their time, from wherever they come: a running server or a
// recording.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/strands/scene_asset.h"
#include "common/strands/snapshot.h"

namespace strandcast {

/// What stays the same of all states.
struct ExportScene {
  std::shared_ptr<const SceneAsset> asset;
  float strand_radius_m = 0.0f;  // as drawn, at the root
  float tip_scale = 1.0f;        // radius at the tip over radius at the root
};

class ExportSource {
 public:
  virtual ~ExportSource() = default;

  virtual const ExportScene& scene() const = 0;
  /// Leaves states out that frames from `from_s` after the first state on do not need, where it can. Returns
  /// the time of the first state where it is known already. Comes before next().
  virtual Result<std::optional<int64_t>> skip_to([[maybe_unused]] double from_s) {
    return std::optional<int64_t>();
  }
  /// The next state, of a later time than the last one unless time began anew; null when there are no more.
  virtual Result<std::shared_ptr<const Snapshot>> next() = 0;
  /// Sentences about what a person should know of the states so far: "12 states were lost on the way".
  virtual std::vector<std::string> remarks() const = 0;
};

}  // namespace strandcast
