// Laws of what is learned about a link from single frames.
#include "server/net/link_estimate.h"

namespace strandcast {
namespace {

constexpr int64_t kSecondNs = 1'000 * kNsPerMs;

/// A frame that took `round_trip_ms` and is acknowledged at `time_ns`.
AckedFrame took(int64_t round_trip_ms, int64_t time_ns, size_t bytes = 100) {
  return {bytes, time_ns - round_trip_ms * kNsPerMs, false, false};
}

TEST(LinkEstimate, TheBareLinkIsTheShortestRoundTripOfTheWindow) {
  LinkEstimate link;
  EXPECT_EQ(link.base_ns(), 0) << "unknown";
  int64_t time_ns = kSecondNs;
  for (const int64_t ms : {30, 20, 50}) link.on_round_trip(ms * kNsPerMs, time_ns += kNsPerMs);
  EXPECT_EQ(link.base_ns(), 20 * kNsPerMs);
  link.on_round_trip(-kNsPerMs, time_ns);
  EXPECT_EQ(link.base_ns(), 20 * kNsPerMs) << "no round trip is negative";
  link.on_round_trip(60 * kNsPerMs, time_ns + kBaseWindowNs + 2 * kNsPerMs);
  EXPECT_EQ(link.base_ns(), 60 * kNsPerMs) << "older ones do not count any more";
}

TEST(LinkEstimate, ALargeFrameThatMetNothingShowsTheRateAndForSoLong) {
  LinkEstimate link;
  int64_t time_ns = kSecondNs;
  link.on_round_trip(20 * kNsPerMs, time_ns);
  EXPECT_EQ(link.capacity_bytes_per_s(time_ns), 0.0);
  EXPECT_EQ(link.transfer_ns(1'000'000, time_ns), 0);
  // 100 kB in a second beyond the bare 20 ms.
  time_ns += 2 * kSecondNs;
  link.on_acked({100'000, time_ns - 1'020 * kNsPerMs, true, true}, time_ns);
  EXPECT_NEAR(link.capacity_bytes_per_s(time_ns), 100e3, 1.0);
  EXPECT_NEAR(static_cast<double>(link.transfer_ns(50'000, time_ns)), 0.5e9, 1e4);
  EXPECT_GT(link.capacity_bytes_per_s(time_ns + kCapacityAgeNs), 0.0);
  EXPECT_EQ(link.capacity_bytes_per_s(time_ns + kCapacityAgeNs + 1), 0.0);
}

TEST(LinkEstimate, SmallFramesOnAFreeLinkSayNothingOfItsRate) {
  LinkEstimate link;
  int64_t time_ns = kSecondNs;
  for (int i = 0; i < 600; ++i) {
    time_ns += 16 * kNsPerMs;
    EXPECT_EQ(link.on_acked(took(20, time_ns), time_ns), 0) << "and wait for nothing";
  }
  EXPECT_EQ(link.capacity_bytes_per_s(time_ns), 0.0);
}

TEST(LinkEstimate, AQueueShowsTheRateAndTheDelayIsWhatIsBeyondTheBareLink) {
  LinkEstimate link;
  constexpr size_t kBytes = 5'000;
  int64_t time_ns = kSecondNs;
  link.on_round_trip(20 * kNsPerMs, time_ns);
  // One frame of 5 kB each 50 ms is what the link carries; each has waited for half a second.
  int64_t delay_ns = 0;
  for (int i = 0; i < 40; ++i) {
    time_ns += 50 * kNsPerMs;
    delay_ns = link.on_acked(took(570, time_ns, kBytes), time_ns);
  }
  EXPECT_NEAR(link.capacity_bytes_per_s(time_ns), 100e3, 1e3);
  EXPECT_NEAR(static_cast<double>(delay_ns), 500e6, 2e6) << "570 less 20 of the link and 50 of its own";
}

TEST(LinkEstimate, ADelayIsNeverNegative) {
  LinkEstimate link;
  int64_t time_ns = kSecondNs;
  for (const int64_t ms : {200, 5, 300, 1, 0}) {
    time_ns += kSecondNs;
    EXPECT_GE(link.on_acked(took(ms, time_ns), time_ns), 0) << ms;
  }
}

TEST(LinkEstimate, APathThatBecameLongerIsBelievedOfAFrameThatMetNothing) {
  LinkEstimate link;
  int64_t time_ns = kSecondNs;
  link.on_round_trip(20 * kNsPerMs, time_ns);
  time_ns += kLongerPathNs + kNsPerMs;
  const AckedFrame alone{100, time_ns - 400 * kNsPerMs, false, true};
  EXPECT_EQ(link.on_acked(alone, time_ns), 0) << "a longer way is no queue";
  EXPECT_EQ(link.base_ns(), 400 * kNsPerMs);
}

}  // namespace
}  // namespace strandcast
