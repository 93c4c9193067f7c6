// TimecodeTrack: the timecode of states by their simulated time, and back. What counts on without a jump is
// one stretch; a frame lies in the first stretch that has it. Plain data; one thread.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/base/timecode.h"

namespace strandcast {

class TimecodeTrack {
 public:
  /// Adds the timecode of a state; times must not decrease.
  void add(int64_t sim_time_ns, const Timecode& timecode);

  /// Returns how the first stretch counts; its frame is that of the first state. Empty: there is no timecode.
  std::optional<Timecode> first() const;

  /// Returns whether timecode begins about with the first state, at `first_ns`, and never jumps.
  bool is_whole(int64_t first_ns) const;

  /// Returns a text such as "01:00:00:00 to 01:00:09:23 of 24 frames per second, with 2 jumps, the first to
  /// 02:00:00:00"; empty without timecode.
  std::string text() const;

  /// Times of a run of frames, simulated.
  struct Frames {
    Timecode first;  // without a part
    std::vector<int64_t> time_ns;
  };
  /// Returns the whole frames from `from` to `to` at most, within one stretch; empty: from its first or to
  /// its last. Both count as first() does. BadInput says where the states begin and end.
  Result<Frames> frames(const std::optional<Timecode>& from, const std::optional<Timecode>& to) const;

 private:
  struct Point {
    int64_t sim_time_ns = 0;
    double place = 0.0;  // in frames after the stretch's first state
  };
  struct Stretch {
    Timecode first;
    std::vector<Point> point;
  };
  static Frames frames_of(const Stretch& stretch, double begin, double end);

  std::vector<Stretch> stretches_;
};

}  // namespace strandcast
