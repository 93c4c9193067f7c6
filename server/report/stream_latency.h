// StreamLatency: where the time from a motion sample to a decoded frame goes, stage by stage, in one process:
// the server's stages as it runs them, TCP on loopback for the network, and the decoder of a viewer. What
// strandcast-view draws, and how long a sample waits for its step, is not in it. Needs the thread's GL
// context for GPU solvers.
#pragma once

#include <string>
#include <vector>

#include "server/report/stream_recording.h"

namespace strandcast {

struct LatencyStage {
  std::string name;
  double median_ms = 0.0;  // wall time
  double p99_ms = 0.0;
};

struct StreamLatency {
  std::string motion;
  StreamSize size;
  std::string codec;
  double bound_m = 0.0;
  double bytes = 0.0;  // of a median message
  std::vector<LatencyStage> stages;
  LatencyStage total;  // of whole frames: not the sum of the stages' quantiles
};

/// Runs the recording's frames through the stages after the solver, whose times the recording has.
Result<StreamLatency> measure_latency(const StreamRecording& recording, const std::string& codec,
                                      double bound_m);

}  // namespace strandcast
