// PlayoutClock: which simulation time to show at a given client time so that motion stays even although
// frames arrive unevenly. Fits a line through recent (receive, simulation) times, so it also follows a server
// that runs slower than real time. Pure arithmetic, one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>

namespace strandcast {

inline constexpr size_t kPlayoutWindow = 64;                // frames, about a second
inline constexpr int64_t kMaxPlayoutDelayNs = 100'000'000;  // for lateness, besides the frames below
inline constexpr int64_t kPlayoutGapNs = 500'000'000;       // a longer silence starts the fit afresh

/// Below this many states a simulated second playout stays two frames behind, so that a cubic through four
/// states (common/replay/interpolation.h) has the one after the moment that is shown; from the other on one
/// again. In between it stays as it is.
inline constexpr double kCubicBelowHz = 45.0;
inline constexpr double kLinearAboveHz = 50.0;
/// What the second frame may cost: at 20 Hz the cubic halves the line's error, at 15 Hz it takes a third off.
inline constexpr double kMostCubicDelayNs = 55e6;
/// How many frames playout is to be behind, when states are so far apart in simulated and in real time and it
/// is `now_behind` of them behind.
uint32_t frames_behind(double sim_frame_ns, double client_frame_ns, uint32_t now_behind);

class PlayoutClock {
 public:
  /// No more than so many frames behind, whatever frames_behind() says, from the next add() on.
  void limit_frames_behind(uint32_t most) { most_frames_behind_ = most; }
  /// A frame of simulation time `sim_time_ns` was received at client time `receive_time_ns`.
  void add(int64_t receive_time_ns, int64_t sim_time_ns);

  bool has_value() const { return samples_.size() >= 2; }
  /// Simulation time to show at `client_time_ns`: frames_behind() behind the fitted line, and further behind
  /// by the lateness that all but 5 % of recent frames stay under, at most kMaxPlayoutDelayNs.
  int64_t sim_time_at(int64_t client_time_ns) const;
  /// The delay behind the newest frame that sim_time_at uses, client ns.
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

/// The simulation time that is shown: follows what a PlayoutClock says, but never backwards and never faster
/// or slower than kCatchUpRate allows, so that a change of the delay or a late burst is caught up without a
/// jump or a freeze.
class PlayoutCursor {
 public:
  /// The time to show at `client_time_ns`, which does not run backwards, when `wanted_ns` would be right.
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
