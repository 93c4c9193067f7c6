// Which codecs strands are served by, and which of them a viewer gets: one whose decoder runs the
// simulation's own steps only where that is affordable, else its fallback. Chosen when the viewer joins, and
// again when its decoding turns out too slow or other steps are simulated. Pure logic.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/result.h"
#include "common/strands/strand_codec.h"

namespace strandcast {

/// Of one core of the viewer, what predicting may take.
inline constexpr double kPredictionShare = 0.5;
/// A link that carries the fallback so many times over needs no fewer bytes.
inline constexpr double kWideLink = 4.0;

/// Decoding by a codec that predicts may take so much of the time between two states that come,
inline constexpr double kSlowDecodeShare = 1.2 * kPredictionShare;
/// and more for less than so long; then the viewer gets the fallback.
inline constexpr int64_t kSlowDecodeNs = 4'000'000'000;
/// After a change of what is simulated, viewers report for so long what was before: their medians are of the
/// last kStageWindow states.
inline constexpr int64_t kSettledDecodeNs = 10'000'000'000;

/// The codec of this name, and behind it its fallback where both take states on the same lattice: one state
/// is published for both. At most kMaxServedCodecs. NotFound for an unknown name.
Result<std::vector<StrandCodecInfo>> served_codecs(const StrandCodecInfo& codec, float bound_m);

/// What decides; what is 0 is unknown.
struct ViewerCodecFacts {
  std::string wish;               // as in Hello
  double step_ns = 0.0;           // as in Hello, or in a ViewerReport since; 0 = it cannot predict
  size_t vertices = 0;            // of all strands
  double states_hz = 60.0;        // steps of the simulation
  double substeps = 1.0;          // solver steps in each
  std::string solver;             // its name
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

/// How one viewer gets on with its codec; what is 0 is unknown.
struct DecodeLoad {
  double decode_ms = 0.0;  // of a state, as in its newest ViewerReport
  double states_hz = 0.0;  // that come; 0 = it gets no strands now
};

/// Who gets which of `served`: a sentence for --explain.
std::string explain_viewer_codecs(const std::vector<StrandCodecInfo>& served);

/// Follows one viewer: from a codec that predicts it goes to the fallback when it decodes too slowly, unless
/// it asked for that codec. It comes back only after another solver, or another number of substeps, is
/// simulated, when all is chosen anew; so it is when it has learnt to predict.
class ViewerCodecWatch {
 public:
  /// What was chosen when it joined, and by which facts.
  ViewerCodecWatch(ViewerCodecFacts facts, size_t codec) : facts_(std::move(facts)), codec_(codec) {}

  /// As of the last choice.
  const ViewerCodecFacts& facts() const { return facts_; }
  /// Call often. `facts` of now; the codec from now on, if it is another.
  std::optional<ViewerCodec> look(const std::vector<StrandCodecInfo>& served, const ViewerCodecFacts& facts,
                                  const DecodeLoad& load, int64_t time_ns);

 private:
  bool is_too_slow(const DecodeLoad& load, int64_t time_ns);

  ViewerCodecFacts facts_;
  size_t codec_;
  std::optional<int64_t> slow_since_ns_;
  int64_t settled_ns_ = 0;  // reports from then on are of what is simulated now
};

}  // namespace strandcast
