#include "client/app/picture_latency.h"
#include "common/base/units.h"

#include <gtest/gtest.h>

#include <limits>

namespace strandcast::picture_latency_test {
namespace {
constexpr int64_t kAheadNs = 70'000 * kMsInNs;  // the server's clock

class Latency : public testing::Test {
 protected:
  // A probe without a way: the offset is exact.
  Latency() { clock_.add(0, kAheadNs, kAheadNs, 0); }
  void picture(int64_t sim_ms, int64_t decoded_ms) {
    latency_.add_picture(sim_ms * kMsInNs, decoded_ms * kMsInNs, clock_);
  }
  void motion(int64_t sim_ms, int64_t arrival_ms) {
    const PictureMotion told[] = {{sim_ms * kMsInNs, kAheadNs + arrival_ms * kMsInNs}};
    latency_.add_motions(told, clock_);
  }
  double newest_ms() const { return latency_.timer().quantile_ms(1.0); }
  uint64_t samples() const { return latency_.timer().count(); }

  ClockOffset clock_;
  PictureLatency latency_;
};

TEST_F(Latency, IsFromTheSampleToThePictureThatShowsItWhicheverIsToldFirst) {
  picture(100, 1000);
  picture(150, 1060);
  motion(150, 1010);
  EXPECT_EQ(samples(), 1u);
  EXPECT_DOUBLE_EQ(newest_ms(), 50.0);
  motion(200, 1030);  // is on its way
  EXPECT_EQ(samples(), 1u);
  picture(200, 1120);
  EXPECT_EQ(samples(), 2u);
  EXPECT_DOUBLE_EQ(newest_ms(), 90.0);
}

TEST_F(Latency, OfAPictureThatThisViewerNeverGotTheNextOneCounts) {
  picture(100, 1000);
  motion(150, 1010);
  motion(200, 1060);
  picture(250, 1180);
  EXPECT_EQ(samples(), 2u);
  EXPECT_DOUBLE_EQ(newest_ms(), 170.0);
}

TEST_F(Latency, TheSamePictureAgainShowsNothingNew) {
  picture(100, 1000);
  picture(150, 1060);
  picture(150, 1400);  // finely
  motion(150, 1010);
  EXPECT_DOUBLE_EQ(newest_ms(), 50.0);
}

TEST_F(Latency, WhatWasDrawnBeforeThisViewerCameDoesNotCount) {
  motion(50, 900);
  picture(100, 1000);
  motion(60, 910);
  motion(100, 950);
  EXPECT_EQ(samples(), 0u);
  // Nor what was drawn while it looked at strands.
  picture(150, 1050);
  latency_.restart();
  motion(200, 1070);
  picture(900, 2000);
  motion(800, 1900);
  EXPECT_EQ(samples(), 0u);
}

TEST_F(Latency, NeedsAClockAndBelievesNoTimeThatNobodyCanMean) {
  PictureLatency without;
  without.add_picture(100 * kMsInNs, 0, ClockOffset());
  without.add_picture(150 * kMsInNs, 0, ClockOffset());
  const PictureMotion told[] = {{150 * kMsInNs, 5}};
  without.add_motions(told, ClockOffset());
  EXPECT_EQ(without.timer().count(), 0u);
  constexpr int64_t kLeast = std::numeric_limits<int64_t>::min(), kMost = std::numeric_limits<int64_t>::max();
  picture(100, 1000);
  picture(150, 1050);
  const PictureMotion mad[] = {
      {kLeast, kMost}, {kMost, kLeast}, {150 * kMsInNs, kLeast}, {150 * kMsInNs, kMost}};
  for (int i = 0; i < 100; ++i) latency_.add_motions(mad, clock_);
  latency_.add_picture(kMost, kMost, clock_);
  EXPECT_EQ(samples(), 0u);
}

}  // namespace
}  // namespace strandcast::picture_latency_test
