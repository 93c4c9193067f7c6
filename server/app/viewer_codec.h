// Which codecs strands are served by, and which of them a viewer gets: one whose decoder runs the
// simulation's own steps only where that is affordable, else its fallback. Chosen once, when the viewer
// joins. Pure logic.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/strands/strand_codec.h"

namespace strandcast {

/// Of one core of the viewer, what predicting may take.
inline constexpr double kPredictionShare = 0.5;
/// A link that carries the fallback so many times over needs no fewer bytes.
inline constexpr double kWideLink = 4.0;

/// The codec of this name, and behind it its fallback where both take states on the same lattice: one state
/// is published for both. At most kMaxServedCodecs. NotFound for an unknown name.
Result<std::vector<StrandCodecInfo>> served_codecs(const StrandCodecInfo& codec, float bound_m);

/// What decides; what is 0 is unknown.
struct ViewerCodecFacts {
  std::string wish;               // as in Hello
  double step_ns = 0.0;           // as in Hello; 0 = it cannot predict
  size_t vertices = 0;            // of all strands
  double states_hz = 60.0;        // steps of the simulation
  double substeps = 1.0;          // solver steps in each
  double solver_cost = 1.0;       // of a step of this solver against the one that step_ns was measured with
  double link_bytes_per_s = 0.0;  // of the viewer; unknown counts as thin
  double fallback_bytes_per_s = 0.0;  // what all strands take by the fallback
};

struct ViewerCodec {
  size_t codec = 0;    // of those served
  std::string reason;  // a sentence for the viewer and the log
};
/// `served`: as served_codecs() gives them.
ViewerCodec choose_viewer_codec(const std::vector<StrandCodecInfo>& served, const ViewerCodecFacts& facts);

}  // namespace strandcast
