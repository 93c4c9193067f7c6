// Timecode: the number of a frame since midnight, as stages count them (SMPTE ST 12-1), with the part of that
// frame that has passed. Rates are 24, 25, 30, 48, 50 and 60 frames per second, and 1000/1001 of all but 25
// and
// 50. Drop-frame counting leaves out numbers, never frames. Pure functions, any thread.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "common/base/frame_rate.h"
#include "common/base/result.h"

namespace strandcast {

struct Timecode {
  FrameRate rate{24, 1};
  bool is_drop = false;  // of 29.97 and 59.94: 2 and 4 numbers a minute are left out, but every tenth minute
  uint32_t frame = 0;    // since midnight, below frames_per_day()
  double part = 0.0;     // of that frame that has passed, in [0, 1)

  bool operator==(const Timecode&) const = default;
};

struct TimecodeFields {
  uint32_t hours = 0;
  uint32_t minutes = 0;
  uint32_t seconds = 0;
  uint32_t frames = 0;

  bool operator==(const TimecodeFields&) const = default;
};

/// Returns whether frames of this rate are counted so.
bool is_timecode_rate(const FrameRate& rate, bool is_drop);

/// Returns the numbers from midnight to midnight. The rate is one of is_timecode_rate(), here and below.
uint32_t frames_per_day(const FrameRate& rate, bool is_drop);

/// Makes the timecode of a frame's beginning. BadInput for another rate, a field out of range, or a number
/// that drop-frame counting leaves out.
Result<Timecode> make_timecode(const TimecodeFields& fields, const FrameRate& rate, bool is_drop);

/// Returns hours, minutes, seconds and frames; a whole day or more counts from midnight again.
TimecodeFields fields_of(const Timecode& timecode);

/// Parses "01:02:03:04", or "01:02:03;04" for drop-frame counting. BadInput says what is wrong.
Result<Timecode> parse_timecode(std::string_view text, const FrameRate& rate);

/// Formats a timecode as parse_timecode() reads it, without the part of the frame.
std::string timecode_text(const Timecode& timecode);

/// Returns the timecode `frames` later, or earlier where that is negative; it goes on past midnight.
Timecode advanced(const Timecode& timecode, double frames);

/// Returns the frames from one timecode to another of the same rate and counting, by the shorter way round
/// midnight.
double frames_between(const Timecode& from, const Timecode& to);

/// Returns whether two timecodes count alike, so that frames_between() is defined.
inline bool is_same_count(const Timecode& a, const Timecode& b) {
  return a.rate == b.rate && a.is_drop == b.is_drop;
}

}  // namespace strandcast
