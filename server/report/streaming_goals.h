// What the codecs tangent and step have to reach, and whether a streaming report shows that it does. Any
// thread.
#pragma once

#include <string>
#include <vector>

#include "server/report/streaming.h"

namespace strandcast {

enum class Verdict { Met, Missed, NotMeasured };
/// "met", "missed", "not measured".
const char* to_string(Verdict verdict);

struct GoalLine {
  std::string goal;
  std::string measured;  // the figures that decide, and where they are from
  Verdict verdict = Verdict::NotMeasured;
};

/// Every goal; the worst recording that it is stated for decides: of the report's first solver those of
/// tangent, of the solver that it names one of step, of all what is about the bound.
std::vector<GoalLine> judge_streaming(const StreamingReport& report);

enum class PeerKind { Plain, Temporal };
/// The best peer on one recording at the goals' bound, by bits; nullptr when there is none. Peers that miss
/// the bound, and those with a bound of their own, take no part.
const StreamingRow* best_peer(const StreamingReport& report, const StreamingRow& ours, PeerKind kind);

}  // namespace strandcast
