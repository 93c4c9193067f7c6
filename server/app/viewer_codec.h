// Chooses which of the served codecs a viewer gets. A codec that predicts, so that its decoder runs the
// simulation's own steps, is used only where that is affordable; other viewers get its fallback. Chosen when
// the viewer joins, and again when decoding turns out too slow or the simulated steps change. Pure logic.
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

/// Largest share of one core of the viewer that prediction may take.
inline constexpr double kPredictionShare = 0.5;
/// Factor by which a link must exceed the fallback's bytes for the fallback to be used, since fewer bytes
/// then bring nothing.
inline constexpr double kWideLink = 4.0;

/// Largest share of the time between received states that a predicting decoder may take.
inline constexpr double kSlowDecodeShare = 1.2 * kPredictionShare;
/// Time for which decoding may exceed that share; then the viewer gets the fallback.
inline constexpr int64_t kSlowDecodeNs = 4'000'000'000;
/// Time after a change of the simulation during which viewers still report old medians, which cover the last
/// kStageWindow states.
inline constexpr int64_t kSettledDecodeNs = 10'000'000'000;

/// Returns the named codec, followed by its fallback if both use states on the same lattice, because one
/// state is published for both. At most kMaxServedCodecs. NotFound for an unknown name.
Result<std::vector<StrandCodecInfo>> served_codecs(const StrandCodecInfo& codec, float bound_m);

/// Decoded states that may differ from the server's within kWrongStatesNs; then the viewer gets the fallback.
inline constexpr uint32_t kMostWrongStates = 1;
inline constexpr int64_t kWrongStatesNs = 10'000'000'000;

/// Facts that decide the choice; 0 means unknown.
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
/// Chooses a viewer's codec; `served` must come from served_codecs().
ViewerCodec choose_viewer_codec(const std::vector<StrandCodecInfo>& served, const ViewerCodecFacts& facts);

/// What a viewer's decoding with its codec costs, and whether it succeeds; 0 means unknown.
struct DecodeLoad {
  double decode_ms = 0.0;     // of a state, as in its newest ViewerReport
  double states_hz = 0.0;     // that come; 0 = it gets no strands now
  uint32_t wrong_states = 0;  // so far, as in its newest ViewerReport
};

/// Returns a sentence for --explain about which viewers get which of the `served` codecs.
std::string explain_viewer_codecs(const std::vector<StrandCodecInfo>& served);

/// Follows one viewer. If a predicting codec decodes too slowly, the viewer goes to the fallback, unless it
/// asked for that codec; also if its states are other ones than the server's. It is chosen anew only when
/// another solver or another number of substeps is simulated, or when the viewer has become able to predict.
class ViewerCodecWatch {
 public:
  /// Starts with the choice that was made when the viewer joined, and its facts.
  ViewerCodecWatch(ViewerCodecFacts facts, size_t codec) : facts_(std::move(facts)), codec_(codec) {}

  /// Returns the facts of the last choice.
  const ViewerCodecFacts& facts() const { return facts_; }
  /// Checks the choice; call it often with current `facts`. Returns the new codec if it changes.
  std::optional<ViewerCodec> look(const std::vector<StrandCodecInfo>& served, const ViewerCodecFacts& facts,
                                  const DecodeLoad& load, int64_t time_ns);

 private:
  bool is_too_slow(const DecodeLoad& load, int64_t time_ns);
  bool is_wrong(const DecodeLoad& load, int64_t time_ns);

  ViewerCodecFacts facts_;
  size_t codec_;
  std::optional<int64_t> slow_since_ns_;
  uint32_t wrong_seen_ = 0;    // states so far
  uint32_t wrong_before_ = 0;  // of these, not counted any more
  int64_t wrong_until_ns_ = 0;
  int64_t settled_ns_ = 0;  // reports from then on are of what is simulated now
};

}  // namespace strandcast
