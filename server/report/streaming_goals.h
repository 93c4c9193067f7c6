// Goals of the codecs tangent and step, and whether a streaming report meets them. Any thread.
#pragma once

#include <string>
#include <vector>

#include "server/report/streaming.h"

namespace strandcast {

enum class Verdict { Met, Missed, NotMeasured };
/// Returns "met", "missed" or "not measured".
const char* to_string(Verdict verdict);

struct GoalLine {
  std::string goal;
  std::string measured;  // the figures that decide, and where they are from
  Verdict verdict = Verdict::NotMeasured;
};

/// Judges every goal by the worst recording that it applies to: those of tangent by the first solver, those
/// of step by the solver that they name, those about the bound by all.
std::vector<GoalLine> judge_streaming(const StreamingReport& report);

enum class PeerKind { Plain, Temporal };
/// Returns the peer with the fewest bits on one recording at the goals' bound; nullptr if there is none.
/// Peers that miss the bound or have a bound of their own are ignored.
const StreamingRow* best_peer(const StreamingReport& report, const StreamingRow& ours, PeerKind kind);

}  // namespace strandcast
