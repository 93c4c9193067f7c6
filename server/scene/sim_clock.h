// SimClock: when the next fixed step is due. A late simulation catches up by at most kMaxCatchUpSteps; older
// steps are dropped and counted, so that one slow moment never becomes a lasting delay. Pure logic: time is
// passed in.
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

  /// Takes the next step if it is due by `time_ns`: the server time that its end stands for. While paused
  /// only steps asked for by add_single_steps().
  std::optional<int64_t> take_step(int64_t time_ns);
  /// Leaves out all steps that are due by `time_ns`, which nobody needs: they are taken as far as the pace
  /// goes. Gives how many; none while paused.
  uint64_t skip(int64_t time_ns);
  /// When take_step() will have one; nullopt while paused.
  std::optional<int64_t> next_due_ns() const;

  void pause();
  /// Goes on from `time_ns`: the pause is not caught up.
  void resume(int64_t time_ns);
  bool is_paused() const { return is_paused_; }
  /// So many more steps while paused; false when running.
  bool add_single_steps(uint32_t count);
  /// Steps asked for by add_single_steps() are waiting.
  bool has_single_steps() const { return single_steps_ > 0; }

  /// Steps taken over steps that real time asked for, within the last second; 0 while paused.
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
