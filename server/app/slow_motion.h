// Slow motion: the simulation takes longer than the time that it simulates. When that lasts a person is told,
// with the settings that cost least to look at and what each of them gains. Pure logic: times are passed in.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/scene/scene_desc.h"

namespace strandcast {

struct ServerCounters;

/// Simulated per real time below this, for so long, is slow motion.
inline constexpr double kSlowFactor = 0.95;
inline constexpr int64_t kSlowNs = 2'000'000'000;

class SlowMotionWatch {
 public:
  enum class Change { None, Began, Ended };

  /// Takes the factor of now. Slow motion also ends only when the factor was back for kSlowNs; a pause ends
  /// it without a word.
  Change update(double realtime_factor, bool is_paused, int64_t time_ns);
  bool is_slow() const { return is_slow_; }

 private:
  bool is_slow_ = false;
  bool is_turning_ = false;  // the factor says otherwise since turned_ns_
  int64_t turned_ns_ = 0;
};

/// Where the time of one simulation step goes, ms, on all threads together.
struct StepWork {
  double simulate_ms = 0.0;  // all substeps
  double publish_ms = 0.0;   // reading back and rounding
  double encode_ms = 0.0;    // states of strands for viewers
  double picture_ms = 0.0;   // drawing and coding pictures, and the states for them alone
  size_t vertices = 0;       // of all strands; 0 = unknown

  double total_ms() const { return simulate_ms + publish_ms + encode_ms + picture_ms; }
};
/// Of a scene as it runs, with its substeps and rates of now.
StepWork work_per_step(const SceneDesc& scene, const ServerCounters& now);

struct WayOut {
  std::string setting;  // "stream.strand_rate_hz=30"
  double saved_ms = 0.0;
  bool is_live = false;  // strandcast-ctl set does it, else it needs a start with --set
};
inline constexpr size_t kShownWaysOut = 2;
/// A setting that saves less than this share of the work is no way out.
inline constexpr double kLeastSaved = 0.05;

/// The strand model that costs least, as sim_bench measures it at 10,000 x 32 on two cores, without a GPU.
inline constexpr const char* kCheapestSolver = "dftl";
inline constexpr double kCheapestSolverMsPerVertex = 4.5 / 320'000;

/// The first kShownWaysOut settings that save something: those that alone bring real time back, then others,
/// in each those that are seen least first.
std::vector<WayOut> ways_out(const SceneDesc& scene, const StepWork& work);

/// "Slow motion: the simulation runs at 0.57 of real time; ...", for log and viewers; without the factor
/// where it is real time again and not yet for long.
std::string slow_motion_text(double realtime_factor, const SceneDesc& scene, const StepWork& work);

}  // namespace strandcast
