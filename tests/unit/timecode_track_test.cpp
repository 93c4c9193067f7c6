// Timecode of states and their simulated times, both ways.
#include "client/export/timecode_track.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "common/base/units.h"

namespace strandcast::timecode_track_test {
namespace {

using testing::HasSubstr;

// A take's law: over ten minutes of a camera whose clock drifts by 200 ppm its frames are where it was,
// within half a frame. Frames that are counted from the beginning by simulated time are beyond two frames in
// the end.
TEST(TimecodeTrack, FramesAreTheCamerasOverTenMinutesOfDrift) {
  for (const double drift : {200e-6, -200e-6}) {
    const Timecode first = *parse_timecode("23:55:00:00", {24, 1});
    const double camera_hz = 24.0 * (1.0 + drift);
    TimecodeTrack track;
    for (int i = 0; i <= 36'000; ++i) {
      const double time_s = i / 60.0;
      track.add(std::llround(time_s * kNsPerS), advanced(first, time_s * camera_hz));
    }
    const auto frames = track.frames({}, {});
    ASSERT_TRUE(frames);
    EXPECT_EQ(frames->first, first);
    ASSERT_NEAR(static_cast<double>(frames->time_ns.size()), 600.0 * camera_hz, 1.0);
    double worst = 0.0;
    for (size_t k = 0; k < frames->time_ns.size(); ++k)
      worst = std::max(worst, std::abs(static_cast<double>(frames->time_ns[k]) / kNsPerS * camera_hz -
                                       static_cast<double>(k)));
    EXPECT_LE(worst, 0.5) << drift;
    const double counted = static_cast<double>(frames->time_ns.size() - 1) / 24.0 * camera_hz;
    EXPECT_GT(std::abs(counted - static_cast<double>(frames->time_ns.size() - 1)), 2.0);
  }
}

// A camera's frames of 25 a second are told 60 times a second, some of them late: states show a moment ahead,
// and then go back to it. Every frame is there, where it is first seen.
TEST(TimecodeTrack, StatesThatGoBackToWhatTheyShowedAreNoJump) {
  const Timecode first = *parse_timecode("01:00:00:00", {25, 1});
  TimecodeTrack track;
  double ahead_s = 0.0;
  for (int i = 0; i <= 240; ++i) {
    const double time_s = i / 60.0;
    ahead_s = i % 20 == 0 ? 0.0 : i % 20 > 14 ? ahead_s + 1.0 / 60.0 : ahead_s;
    const double told = std::floor((time_s - ahead_s) * 25.0);
    track.add(std::llround(time_s * kNsPerS), advanced(first, told + ahead_s * 25.0));
  }
  EXPECT_TRUE(track.is_whole(0)) << track.text();
  const auto frames = track.frames(advanced(first, 25.0), advanced(first, 75.0));
  ASSERT_TRUE(frames);
  ASSERT_EQ(frames->time_ns.size(), 51u);
  for (size_t k = 0; k < frames->time_ns.size(); ++k)
    EXPECT_NEAR(static_cast<double>(frames->time_ns[k]) / kNsPerS, 1.0 + static_cast<double>(k) / 25.0, 0.04);
}

TEST(TimecodeTrack, FindsFramesInTheFirstStretchThatHasThem) {
  TimecodeTrack track;
  const auto at = [](const char* text) { return *parse_timecode(text, {25, 1}); };
  const auto add = [&track, at](double begin_s, const char* first) {
    for (int i = 0; i <= 50; ++i)
      track.add(std::llround((begin_s + i / 50.0) * kNsPerS), advanced(at(first), i / 2.0));
  };
  EXPECT_FALSE(track.first());
  EXPECT_THAT(track.frames({}, {}).error().message, HasSubstr("carry no timecode"));
  add(0.0, "01:00:00:00");
  EXPECT_TRUE(track.is_whole(0));
  EXPECT_FALSE(track.is_whole(-2 * kSInNs)) << "timecode began two seconds later";
  add(2.0, "00:10:00:00");  // it jumps back
  add(4.0, "01:00:00:10");  // and there again
  EXPECT_FALSE(track.is_whole(0));
  EXPECT_EQ(timecode_text(*track.first()), "01:00:00:00");
  EXPECT_EQ(track.frames(at("00:10:00:05"), {})->time_ns.front(), 2'200'000'000);
  EXPECT_EQ(track.frames(at("01:00:00:20"), {})->time_ns.front(), 800'000'000);
  const auto range = track.frames(at("01:00:00:05"), at("01:00:00:08"));
  EXPECT_EQ(range->time_ns, (std::vector<int64_t>{200'000'000, 240'000'000, 280'000'000, 320'000'000}));
  EXPECT_EQ(track.frames({}, at("01:00:00:01"))->time_ns.size(), 2u);
  EXPECT_THAT(track.frames(at("05:00:00:00"), {}).error().message, HasSubstr("with jumps"));
  EXPECT_THAT(track.text(), testing::StartsWith("01:00:00:00 to 01:00:0"));
  EXPECT_THAT(track.text(),
              testing::EndsWith("of 25 frames per second, with 2 jumps, the first to 00:10:00:00"));
  EXPECT_EQ(TimecodeTrack().text(), "");
}

}  // namespace
}  // namespace strandcast::timecode_track_test
