// ExportSource: states of strands in the order of their time, from wherever they come: a running server or a
// recording.
#pragma once

#include <memory>
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
  /// The next state, of a later time than the last one unless time began anew; null when there are no more.
  virtual Result<std::shared_ptr<const Snapshot>> next() = 0;
  /// Sentences about what a person should know of the states so far: "12 states were lost on the way".
  virtual std::vector<std::string> remarks() const = 0;
};

}  // namespace strandcast
