// System: a server, relays, viewers, feeders and controllers of the product itself, each on a machine of the
// world of its own, and faults of their links, machines and clocks.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "common/scene/scene_desc.h"

namespace strandcast::vopr {

/// Faults of a program that the rules must find; each is planted once in a run.
enum class Plant {
  None,
  WrongHash,
  StaysAway,
  DoneTwice,
  TokenInLog,
  Deaf,
  RelayEnds,      // at its first loss
  FirstIsFinal,   // a viewer goes when an attempt fails
  FeederEnds,     // at its first loss
  OneQueue,       // the honest controller shares its session's budget with one that floods
  LongCommand,    // the simulation does something for a minute
  ReportForgets,  // a viewer's counts are those of its last connection
  LostBytes,      // a disk drops some of what it has taken
};

struct RunPlan {
  uint64_t seed = 1;
  double simulated_s = 60.0;  // with new faults; it goes on until all are well again
  Plant plant = Plant::None;
  bool has_faults = true;
  bool is_shown = false;         // every line, as it comes
  std::filesystem::path folder;  // for recordings
};

struct RunResult {
  uint64_t digest = 0;  // equal for equal plans
  double simulated_s = 0.0;
  uint64_t compared_states = 0;
  uint64_t answered_changes = 0;
  uint64_t recorded_states = 0;  // that were recovered
  uint64_t faults = 0;
  uint64_t switches = 0;
  int64_t back_median_ms = 0, back_longest_ms = 0;
  double back_share_2s = 1.0;  // of those who were disturbed, within kBackNs of the fault's end
};

/// What the server simulates, by this strand codec.
SceneDesc scene_of_run(const std::string& codec);

/// In a process of its own. A rule that is broken ends the process with 1 and the newest lines.
RunResult run_system(const RunPlan& plan);

}  // namespace strandcast::vopr
