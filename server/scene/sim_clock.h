// SimClock: determines when the next fixed step is due. A late simulation catches up by at most
// kMaxCatchUpSteps. Older steps are dropped and counted, so that one slow moment never becomes a lasting
// delay. Pure logic: time is passed in.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>

namespace strandcast {

inline constexpr int64_t kMaxCatchUpSteps = 4;

class SimClock {
 public:
  /// Starts running; the first step is due one step after `time_ns`.
  SimClock(double step_s, int64_t time_ns);

  /// Takes the next step if it is due by `time_ns` and returns the server time of its end. While paused, only
  /// steps from add_single_steps() are taken.
  std::optional<int64_t> take_step(int64_t time_ns);
  /// Skips all steps that are due by `time_ns`, because nobody needs them; the real-time factor counts them
  /// as taken. Returns their number; 0 while paused.
  uint64_t skip(int64_t time_ns);
  /// Returns when the next step is due; nullopt while paused.
  std::optional<int64_t> next_due_ns() const;

  void pause();
  /// Resumes at `time_ns`; the paused time is not caught up.
  void resume(int64_t time_ns);
  bool is_paused() const { return is_paused_; }
  /// Adds `count` single steps while paused; returns false if running.
  bool add_single_steps(uint32_t count);
  /// Returns whether steps of add_single_steps() are waiting.
  bool has_single_steps() const { return single_steps_ > 0; }

  /// Returns steps taken divided by steps that real time required, within the last second; 0 while paused.
  double realtime_factor(int64_t time_ns) const;
  uint64_t dropped_steps() const { return dropped_steps_; }

 private:
  int64_t due_ns() const;

  const double step_ns_;
  int64_t origin_ns_;  // multiples of the step count from here, so that rounding never adds up
  int64_t next_step_ = 1;
  bool is_paused_ = false;
  uint32_t single_steps_ = 0;
  int64_t running_since_ns_;
  uint64_t dropped_steps_ = 0;
  std::deque<int64_t> taken_ns_;  // within the last second
};

}  // namespace strandcast
