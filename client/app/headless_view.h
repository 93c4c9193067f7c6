// The viewer without a window: receives for a while, then renders what it decoded into a picture and a clip.
// Receiving comes first and rendering after it, so that a slow software renderer distorts neither times nor
// measurements.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <vector>

#include "client/app/view_options.h"
#include "client/app/view_report.h"
#include "client/app/viewer_session.h"

namespace strandcast {

/// Picks snapshots (or pictures) at an even rate of simulated time.
class ClipSampler {
 public:
  ClipSampler(double pictures_per_s, double duration_s);
  /// True when the state of this simulation time belongs into the clip.
  bool wants(int64_t sim_time_ns);
  bool is_full() const { return taken_ >= wanted_; }
  size_t wanted() const { return wanted_; }

 private:
  double period_ns_;
  size_t wanted_;
  size_t taken_ = 0;
  int64_t last_ns_ = 0;
  double next_ns_ = 0.0;
};

/// Runs to the end its options ask for; the error is one sentence for the user. `stop` ends it early
/// (Ctrl-C).
Result<ViewReport> run_headless(const ViewOptions& options, const std::atomic<bool>& stop);

}  // namespace strandcast
