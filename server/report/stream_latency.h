// StreamLatency: durations of the stages from a motion sample to a decoded frame, in one process: the
// server's own stages, TCP on loopback, and a viewer's decoder. It excludes drawing by strandcast-view and a
// sample's wait for its step. Needs the thread's GL context for GPU solvers.
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

/// Runs the recording's frames through the stages after the solver; the recording has the solver's times.
Result<StreamLatency> measure_latency(const StreamRecording& recording, const std::string& codec,
                                      double bound_m);

}  // namespace strandcast
