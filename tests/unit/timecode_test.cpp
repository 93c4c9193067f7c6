// Rates as exact quotients, and timecode: whole days of every rate against an odometer that counts by the
// rules of SMPTE ST 12-1.
#include "common/base/timecode.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

namespace strandcast::timecode_test {
namespace {

using testing::HasSubstr;

TEST(FrameRate, IsReadAsPeopleWriteIt) {
  const auto rate = [](std::string_view text) { return parse_frame_rate(text); };
  for (const auto& [text, exact] :
       std::vector<std::pair<const char*, FrameRate>>{{"24", {24, 1}},
                                                      {"23.976", {24000, 1001}},
                                                      {"23.98", {24000, 1001}},
                                                      {"24000/1001", {24000, 1001}},
                                                      {"29.97", {30000, 1001}},
                                                      {"59.94", {60000, 1001}},
                                                      {"119.88", {120000, 1001}},
                                                      {"50", {50, 1}},
                                                      {"12.5", {25, 2}},
                                                      {"25/2", {25, 2}},
                                                      {"240", {240, 1}},
                                                      {"24.000", {24, 1}},
                                                      {"48/2", {24, 1}},
                                                      {"59.94006", {60000, 1001}},
                                                      {"1234567/12345.67", {100, 1}},
                                                      {"0.001", {1, 1000}},
                                                      {"0.000001", {1, 1'000'000}},
                                                      {"1/500000", {1, 500'000}}}) {
    ASSERT_TRUE(rate(text)) << text;
    EXPECT_EQ(*rate(text), exact) << text;
  }
  for (const char* text : {"", "fast", "24fps", "24/", "/1001", "24/0", "nan", "inf", "24 ", "1/2/3", "1e2",
                           ".", ".5", "--1", "1.2.3", "+24"}) {
    ASSERT_FALSE(rate(text)) << text;
    EXPECT_THAT(rate(text).error().message, HasSubstr("24000/1001")) << text;
  }
  for (const char* text : {"0", "-24", "240.5", "10000000000", "0.0000001", "24/-1", "-24/-1", "0/1"}) {
    ASSERT_FALSE(rate(text)) << text;
    EXPECT_THAT(rate(text).error().message, HasSubstr("0.000001 to 240 are possible")) << text;
  }
  // As cameras write it.
  for (const char* text : {"29.97df", "29.97nd", "29.97ndf"})
    EXPECT_THAT(rate(text).error().message, HasSubstr("write 29.97; a timecode's ; counts drop-frame"))
        << text;
  EXPECT_THAT(rate("59.94df").error().message, HasSubstr("write 59.94;"));
  EXPECT_EQ(frame_rate_text(24000.0 / 1001.0), "23.976");
  EXPECT_EQ(frame_rate_text(119.88011988), "119.88");
  EXPECT_EQ(frame_rate_text(30.0), "30");
  EXPECT_EQ(frame_rate_text(0.0001), "0.0001");
}

struct Count {
  FrameRate rate;
  bool is_drop = false;
};

const std::vector<Count> kCounts = {
    {{24000, 1001}}, {{24, 1}}, {{25, 1}}, {{30000, 1001}}, {{30000, 1001}, true}, {{30, 1}},
    {{48000, 1001}}, {{48, 1}}, {{50, 1}}, {{60000, 1001}}, {{60000, 1001}, true}, {{60, 1}}};

/// The next number of a counter that leaves out the first numbers of each minute but every tenth.
void count_on(TimecodeFields& at, uint32_t per_second, uint32_t dropped) {
  if (++at.frames < per_second) return;
  at.frames = 0;
  if (++at.seconds < 60) return;
  at.seconds = 0;
  if (++at.minutes == 60) {
    at.minutes = 0;
    at.hours = (at.hours + 1) % 24;
  }
  if (at.minutes % 10 != 0) at.frames = dropped;
}

double seconds_of(const TimecodeFields& at, double per_second) {
  return at.hours * 3600.0 + at.minutes * 60.0 + at.seconds + at.frames / per_second;
}

TEST(Timecode, CountsAWholeDayOfEveryRateByTheRules) {
  for (const auto& [rate, is_drop] : kCounts) {
    ASSERT_TRUE(is_timecode_rate(rate, is_drop));
    const auto per_second = static_cast<uint32_t>(std::ceil(rate.hz()));
    TimecodeFields odometer;
    const uint32_t day = frames_per_day(rate, is_drop);
    for (Timecode at{rate, is_drop}; at.frame < day; ++at.frame) {
      ASSERT_EQ(fields_of(at), odometer) << at.frame;
      if (at.frame % 97 == 0 || odometer.frames < 5) {
        ASSERT_EQ(*make_timecode(odometer, rate, is_drop), at);
      }
      count_on(odometer, per_second, is_drop ? per_second / 15 : 0);
    }
    EXPECT_EQ(odometer, TimecodeFields{}) << "a day later it is midnight";
  }
}

// Why numbers are left out: labels keep to the clock on the wall. Without it they lose 3.6 s an hour.
TEST(Timecode, DropFrameKeepsToTheClockOnTheWall) {
  for (const FrameRate& rate : {FrameRate{30000, 1001}, FrameRate{60000, 1001}}) {
    const double per_second = std::ceil(rate.hz());
    double worst = 0.0, worst_without = 0.0;
    for (Timecode at{rate, true}; at.frame < frames_per_day(rate, true); at.frame += 101) {
      const double wall_s = at.frame / rate.hz();
      worst = std::max(worst, std::abs(seconds_of(fields_of(at), per_second) - wall_s));
      const Timecode without{rate, false, at.frame};
      worst_without = std::max(worst_without, std::abs(seconds_of(fields_of(without), per_second) - wall_s));
    }
    // Two numbers of 30 between droppings, and the 2.6 frames that a day is short of.
    EXPECT_LE(worst, (2.0 + 2.6) / 30.0);
    EXPECT_GT(worst_without, 80.0);
  }
}

TEST(Timecode, HasThePublishedNumbers) {
  const FrameRate ntsc{30000, 1001};
  EXPECT_EQ(parse_timecode("00:01:00;02", ntsc)->frame, 1800u);
  EXPECT_EQ(parse_timecode("00:10:00;00", ntsc)->frame, 17982u);
  EXPECT_EQ(parse_timecode("01:00:00;00", ntsc)->frame, 107892u);
  EXPECT_EQ(frames_per_day(ntsc, true), 2589408u);
  EXPECT_EQ(parse_timecode("01:00:00:00", ntsc)->frame, 108000u);
  EXPECT_EQ(parse_timecode("00:01:00;04", FrameRate{60000, 1001})->frame, 3600u);
  EXPECT_EQ(parse_timecode("01:02:03:04", FrameRate{24, 1})->frame, 89356u);
  EXPECT_EQ(timecode_text({ntsc, true, 1800}), "00:01:00;02");
  EXPECT_EQ(timecode_text({{24000, 1001}, false, 89356}), "01:02:03:04");
}

TEST(Timecode, RefusesWhatIsNone) {
  const auto why = [](std::string_view text, FrameRate rate) {
    const auto parsed = parse_timecode(text, rate);
    return parsed ? std::string() : parsed.error().message;
  };
  for (const char* text : {"", "01:02:03", "1:02:03:04", "01:02:03.04", "01;02:03:04", "0a:00:00:00",
                           "-1:00:00:00", "01:02:03:04 ", "01:02:03:004"})
    EXPECT_THAT(why(text, {24, 1}), HasSubstr("write 01:02:03:04")) << text;
  for (const char* text : {"24:00:00:00", "00:60:00:00", "00:00:60:00", "00:00:00:24"})
    EXPECT_THAT(why(text, {24, 1}), HasSubstr("23:59:59:23")) << text;
  EXPECT_THAT(why("00:01:00;01", {30000, 1001}), HasSubstr("left out of drop-frame"));
  EXPECT_EQ(why("00:10:00;01", {30000, 1001}), "");
  EXPECT_THAT(why("00:00:00;00", {24, 1}), HasSubstr("no timecode counts 24 drop-frame frames per second"));
  for (const FrameRate& rate : {FrameRate{15, 1}, FrameRate{25000, 1001}, FrameRate{119, 5}, FrameRate{0, 1}})
    EXPECT_FALSE(is_timecode_rate(rate, false)) << rate.numerator;
}

TEST(Timecode, GoesOnPastMidnightBothWays) {
  for (const auto& [rate, is_drop] : kCounts) {
    const Timecode last{rate, is_drop, frames_per_day(rate, is_drop) - 1};
    const Timecode first{rate, is_drop};
    EXPECT_EQ(advanced(last, 1.0), first);
    EXPECT_EQ(advanced(first, -1.0), last);
    EXPECT_DOUBLE_EQ(frames_between(last, first), 1.0);
    EXPECT_DOUBLE_EQ(frames_between(first, last), -1.0);
    const Timecode moved = advanced(last, 2.25);
    EXPECT_EQ(moved.frame, 1u);
    EXPECT_NEAR(moved.part, 0.25, 1e-9);
    EXPECT_NEAR(frames_between(last, moved), 2.25, 1e-9);
  }
}

}  // namespace
}  // namespace strandcast::timecode_test
