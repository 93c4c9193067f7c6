// PlaybackClock: the shown moment of a recording: plays, pauses, loops, changes speed and seeks. Pure logic
// on given times, one thread.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace strandcast {

inline constexpr double kSlowestPlayback = 1.0 / 16.0;
inline constexpr double kFastestPlayback = 8.0;

class PlaybackClock {
 public:
  explicit PlaybackClock(double length_s) : length_s_(length_s) {}

  /// Advances to `now_ns`, which must not decrease.
  void advance(int64_t now_ns) {
    const double passed_s = now_ns_ == 0 ? 0.0 : static_cast<double>(now_ns - now_ns_) * 1e-9;
    now_ns_ = now_ns;
    if (!is_playing_) return;
    time_s_ += passed_s * speed_;
    if (time_s_ < length_s_) return;
    if (is_looping_ && length_s_ > 0.0) {
      time_s_ = std::fmod(time_s_, length_s_);
    } else {
      time_s_ = length_s_;
      is_playing_ = false;
    }
  }
  /// Toggles between playing and pausing; at the end, playing restarts from the beginning.
  void toggle() {
    if (!is_playing_ && time_s_ >= length_s_) time_s_ = 0.0;
    is_playing_ = !is_playing_;
  }
  void pause() { is_playing_ = false; }
  void go_to(double time_s) { time_s_ = std::clamp(time_s, 0.0, length_s_); }
  void set_looping(bool is_looping) { is_looping_ = is_looping; }
  void set_speed(double speed) { speed_ = std::clamp(speed, kSlowestPlayback, kFastestPlayback); }

  double time_s() const { return time_s_; }
  double length_s() const { return length_s_; }
  double speed() const { return speed_; }
  bool is_playing() const { return is_playing_; }
  bool is_looping() const { return is_looping_; }

 private:
  double length_s_;
  double time_s_ = 0.0;
  double speed_ = 1.0;
  bool is_playing_ = true;
  bool is_looping_ = false;
  int64_t now_ns_ = 0;
};

}  // namespace strandcast
