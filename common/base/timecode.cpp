#include "common/base/timecode.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include "common/base/text.h"

namespace strandcast {
namespace {

constexpr size_t kMaxShownTimecodeChars = 40;
constexpr uint32_t kMinutesPerDay = 24 * 60;
constexpr uint32_t kSecondsPerMinute = 60;
constexpr uint32_t kMinutesPerTen = 10;

/// Numbers of frames in a second of timecode: 24 at 23.976 frames per second.
uint32_t numbers_per_second(const FrameRate& rate) {
  return static_cast<uint32_t>((uint64_t{rate.numerator} + rate.denominator - 1) / rate.denominator);
}

bool is_ntsc(const FrameRate& rate) {
  return uint64_t{rate.numerator} * 1001 == uint64_t{numbers_per_second(rate)} * 1000 * rate.denominator;
}

/// Numbers that most minutes leave out at their beginning.
uint32_t dropped_per_minute(const FrameRate& rate, bool is_drop) {
  constexpr uint32_t kNumbersPerDropped = 15;  // 2 of 30, 4 of 60
  return is_drop ? numbers_per_second(rate) / kNumbersPerDropped : 0;
}

uint32_t frames_per_ten_minutes(const FrameRate& rate, bool is_drop) {
  return kMinutesPerTen * kSecondsPerMinute * numbers_per_second(rate) -
         (kMinutesPerTen - 1) * dropped_per_minute(rate, is_drop);
}

std::optional<TimecodeFields> read_fields(std::string_view text) {
  constexpr size_t kFieldChars = 2;
  constexpr size_t kChars = 4 * kFieldChars + 3;
  if (text.size() != kChars) return std::nullopt;
  std::array<uint32_t, 4> value{};
  for (size_t i = 0; i < value.size(); ++i) {
    const std::string_view digits = text.substr(i * (kFieldChars + 1), kFieldChars);
    const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), value[i]);
    if (read.ec != std::errc() || read.ptr != digits.data() + digits.size()) return std::nullopt;
  }
  if (text[2] != ':' || text[5] != ':' || (text[8] != ':' && text[8] != ';')) return std::nullopt;
  return TimecodeFields{value[0], value[1], value[2], value[3]};
}

}  // namespace

bool is_timecode_rate(const FrameRate& rate, bool is_drop) {
  if (rate.numerator == 0 || rate.denominator == 0) return false;
  const uint32_t count = numbers_per_second(rate);
  const bool is_ntsc_rate = is_ntsc(rate);
  const bool is_whole = uint64_t{count} * rate.denominator == rate.numerator;
  constexpr std::array<uint32_t, 4> kOfBoth = {24, 30, 48, 60};
  const bool is_usual = std::find(kOfBoth.begin(), kOfBoth.end(), count) != kOfBoth.end();
  if (is_drop) return is_ntsc_rate && (count == 30 || count == 60);
  return (is_usual && (is_whole || is_ntsc_rate)) || (is_whole && (count == 25 || count == 50));
}

uint32_t frames_per_day(const FrameRate& rate, bool is_drop) {
  return kMinutesPerDay / kMinutesPerTen * frames_per_ten_minutes(rate, is_drop);
}

Result<Timecode> make_timecode(const TimecodeFields& fields, const FrameRate& rate, bool is_drop) {
  if (!is_timecode_rate(rate, is_drop))
    return make_error(ErrorCode::BadInput,
                      "no timecode counts {}{} frames per second: 23.976, 24, 25, 29.97, 30, 47.952, 48, 50, "
                      "59.94 and 60 are possible, and 29.97 and 59.94 with drop-frame (;)",
                      frame_rate_text(rate.hz()), is_drop ? " drop-frame" : "");
  const uint32_t count = numbers_per_second(rate);
  const auto& [hours, minutes, seconds, frames] = fields;
  if (hours >= 24 || minutes >= 60 || seconds >= kSecondsPerMinute || frames >= count)
    return make_error(ErrorCode::BadInput,
                      "a timecode of {} frames per second goes from 00:00:00:00 to 23:59:59:{:02}, not to "
                      "{:02}:{:02}:{:02}:{:02}",
                      frame_rate_text(rate.hz()), count - 1, hours, minutes, seconds, frames);
  const uint32_t dropped = dropped_per_minute(rate, is_drop);
  if (seconds == 0 && frames < dropped && minutes % kMinutesPerTen != 0)
    return make_error(ErrorCode::BadInput, "{:02}:{:02}:00;{:02} is left out of drop-frame timecode", hours,
                      minutes, frames);
  const uint32_t whole_minutes = hours * 60 + minutes;
  const uint32_t number = (whole_minutes * kSecondsPerMinute + seconds) * count + frames;
  return Timecode{rate, is_drop, number - dropped * (whole_minutes - whole_minutes / kMinutesPerTen)};
}

TimecodeFields fields_of(const Timecode& timecode) {
  const uint32_t count = numbers_per_second(timecode.rate);
  const uint32_t dropped = dropped_per_minute(timecode.rate, timecode.is_drop);
  const uint32_t of_ten = frames_per_ten_minutes(timecode.rate, timecode.is_drop);
  uint32_t number = timecode.frame % frames_per_day(timecode.rate, timecode.is_drop);
  const uint32_t tens = number / of_ten, rest = number % of_ten;
  const uint32_t first_minute = kSecondsPerMinute * count;
  number += dropped * (kMinutesPerTen - 1) * tens;
  if (rest >= first_minute) number += dropped * ((rest - first_minute) / (first_minute - dropped) + 1);
  const uint32_t seconds = number / count;
  return {seconds / 3600, seconds / 60 % 60, seconds % 60, number % count};
}

Result<Timecode> parse_timecode(std::string_view text, const FrameRate& rate) {
  const auto fields = read_fields(text);
  if (!fields)
    return make_error(ErrorCode::BadInput,
                      "'{}' is no timecode: write 01:02:03:04, or 01:02:03;04 for drop-frame",
                      excerpt(std::string(text), kMaxShownTimecodeChars));
  return make_timecode(*fields, rate, text.find(';') != std::string_view::npos);
}

std::string timecode_text(const Timecode& timecode) {
  const TimecodeFields fields = fields_of(timecode);
  return fmt::format("{:02}:{:02}:{:02}{}{:02}", fields.hours, fields.minutes, fields.seconds,
                     timecode.is_drop ? ";" : ":", fields.frames);
}

Timecode advanced(const Timecode& timecode, double frames) {
  const double day = frames_per_day(timecode.rate, timecode.is_drop);
  const double moved = timecode.frame + timecode.part + frames;
  double place = moved - day * std::floor(moved / day);
  if (place >= day) place = 0.0;  // where the difference was rounded up
  Timecode later = timecode;
  later.frame = static_cast<uint32_t>(place);
  later.part = place - later.frame;
  return later;
}

double frames_between(const Timecode& from, const Timecode& to) {
  const double day = frames_per_day(from.rate, from.is_drop);
  const double whole = static_cast<double>(to.frame) - from.frame + (to.part - from.part);
  return whole - day * std::round(whole / day);
}

}  // namespace strandcast
