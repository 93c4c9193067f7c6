// Detects slow motion: the simulation takes longer than the time that it simulates. If it lasts, viewers are
// told which settings are least visible and how much each of them saves. Pure logic: times are passed in.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/scene/scene_desc.h"

namespace strandcast {

struct ServerCounters;

/// Slow motion begins when simulated time per real time stays below this factor for this long.
inline constexpr double kSlowFactor = 0.95;
inline constexpr int64_t kSlowNs = 2'000'000'000;

class SlowMotionWatch {
 public:
  enum class Change { None, Began, Ended };

  /// Updates with the current factor. Slow motion ends after the factor was back to normal for kSlowNs; a
  /// pause ends it without a report.
  Change update(double realtime_factor, bool is_paused, int64_t time_ns);
  bool is_slow() const { return is_slow_; }

 private:
  bool is_slow_ = false;
  bool is_turning_ = false;  // the factor says otherwise since turned_ns_
  int64_t turned_ns_ = 0;
};

/// Time of one simulation step by its parts, ms, summed over all threads.
struct StepWork {
  double simulate_ms = 0.0;  // all substeps
  double publish_ms = 0.0;   // reading back and rounding
  double encode_ms = 0.0;    // states of strands for viewers
  double picture_ms = 0.0;   // drawing and coding pictures, and the states for them alone
  size_t vertices = 0;       // of all strands; 0 = unknown

  double total_ms() const { return simulate_ms + publish_ms + encode_ms + picture_ms; }
};
/// Returns the work of a scene as it runs, with its current substeps and rates.
StepWork work_per_step(const SceneDesc& scene, const ServerCounters& now);

struct WayOut {
  std::string setting;  // "stream.strand_rate_hz=30"
  double saved_ms = 0.0;
  bool is_live = false;  // strandcast-ctl set does it, else it needs a start with --set
};
inline constexpr size_t kShownWaysOut = 2;
/// Smallest share of the work that a setting must save to be suggested.
inline constexpr double kLeastSaved = 0.05;

/// The cheapest strand model, and its cost as sim_bench measures it at 10,000 x 32 on two cores without a
/// GPU.
inline constexpr const char* kCheapestSolver = "dftl";
inline constexpr double kCheapestSolverMsPerVertex = 4.5 / 320'000;

/// Returns the first kShownWaysOut suggestions. Settings that suffice alone for real time come first, then
/// the others; within each group the least visible come first.
std::vector<WayOut> ways_out(const SceneDesc& scene, const StepWork& work);

/// Returns the text for log and viewers: "Slow motion: the simulation runs at 0.57 of real time; ...". The
/// factor is omitted if real time was reached again, but not for long yet.
std::string slow_motion_text(double realtime_factor, const SceneDesc& scene, const StepWork& work);

}  // namespace strandcast
