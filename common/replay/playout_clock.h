// PlayoutClock: chooses the simulation time to show at a client time, so that motion is even although frames
// arrive unevenly. It fits a line through recent (receive, simulation) times, so it also follows a server
// that is slower than real time. Pure arithmetic, one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>

namespace strandcast {

inline constexpr size_t kPlayoutWindow = 64;                // frames, about a second
inline constexpr int64_t kMaxPlayoutDelayNs = 100'000'000;  // for lateness, besides the frames below
inline constexpr int64_t kPlayoutGapNs = 500'000'000;       // a longer silence starts the fit afresh

/// Rates (states per simulated second) at which the playout delay changes, with hysteresis. Below the first
/// it is two frames, so that the cubic (common/replay/interpolation.h) has a state after the shown moment.
/// Above the second it is one frame.
inline constexpr double kCubicBelowHz = 45.0;
inline constexpr double kLinearAboveHz = 50.0;
/// Largest cost of the second frame of delay in ns. At 20 Hz the cubic halves the line's error, at 15 Hz it
/// removes a third.
inline constexpr double kMostCubicDelayNs = 55e6;
/// Returns the playout delay in frames for this spacing of states in simulated and client time; `now_behind`
/// is the current delay.
uint32_t frames_behind(double sim_frame_ns, double client_frame_ns, uint32_t now_behind);

class PlayoutClock {
 public:
  /// Limits the delay to `most` frames from the next add() on, whatever frames_behind() returns.
  void limit_frames_behind(uint32_t most) { most_frames_behind_ = most; }
  /// Adds a frame of simulation time `sim_time_ns` that was received at client time `receive_time_ns`.
  void add(int64_t receive_time_ns, int64_t sim_time_ns);

  bool has_value() const { return samples_.size() >= 2; }
  /// Returns the simulation time to show at `client_time_ns`: the fitted line, delayed by frames_behind()
  /// frames and by the lateness that 95 % of recent frames stay under (at most kMaxPlayoutDelayNs).
  int64_t sim_time_at(int64_t client_time_ns) const;
  /// Returns the delay after the newest frame that sim_time_at() uses, client ns.
  int64_t delay_ns() const { return delay_ns_; }

 private:
  struct Sample {
    int64_t receive_time_ns;
    int64_t sim_time_ns;
  };
  void fit();

  std::deque<Sample> samples_;
  double sim_per_client_ = 1.0;   // slope of the fit
  double mean_receive_ns_ = 0.0;  // the fit passes through these, relative to the first sample
  double mean_sim_ns_ = 0.0;
  uint32_t frames_behind_ = 1;
  uint32_t most_frames_behind_ = 2;
  int64_t delay_ns_ = 0;
};

/// The simulation time that is shown. It follows a PlayoutClock, but never runs backwards, and its speed
/// changes by at most kCatchUpRate. So a change of delay or a late burst causes neither a jump nor a freeze.
class PlayoutCursor {
 public:
  /// Returns the time to show at `client_time_ns`, which must not decrease, when `wanted_ns` is the ideal
  /// time.
  int64_t advance(int64_t client_time_ns, int64_t wanted_ns);

 private:
  bool is_started_ = false;
  int64_t client_time_ns_ = 0;
  double shown_ns_ = 0.0;
  int64_t wanted_ns_ = 0;
};
inline constexpr double kCatchUpRate = 0.5;             // time may run 1 - this to 1 + this as fast as wanted
inline constexpr int64_t kCatchUpTimeNs = 100'000'000;  // a difference falls by about two thirds in this time
inline constexpr int64_t kCatchUpLimitNs = 500'000'000;  // a larger difference is jumped over

}  // namespace strandcast
