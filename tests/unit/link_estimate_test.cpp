// Laws of what is learned about a link from single frames.
#include "server/net/link_estimate.h"
#include "common/base/units.h"

#include <limits>
#include <utility>
#include <vector>

namespace strandcast::link_estimate_test {
namespace {

/// A frame that took `round_trip_ms` and is acknowledged at `time_ns`.
AckedFrame took(int64_t round_trip_ms, int64_t time_ns, size_t bytes = 100) {
  return {bytes, time_ns - round_trip_ms * kMsInNs, false, false};
}

TEST(LinkEstimate, TheBareLinkIsTheShortestRoundTripOfTheWindow) {
  LinkEstimate link;
  EXPECT_EQ(link.base_ns(), 0) << "unknown";
  int64_t time_ns = kSInNs;
  for (const int64_t ms : {30, 20, 50}) link.on_round_trip(ms * kMsInNs, time_ns += kMsInNs);
  EXPECT_EQ(link.base_ns(), 20 * kMsInNs);
  link.on_round_trip(-kMsInNs, time_ns);
  EXPECT_EQ(link.base_ns(), 20 * kMsInNs) << "no round trip is negative";
  link.on_round_trip(60 * kMsInNs, time_ns + kBaseWindowNs + 2 * kMsInNs);
  EXPECT_EQ(link.base_ns(), 60 * kMsInNs) << "older ones do not count any more";
}

TEST(LinkEstimate, ALargeFrameThatMetNothingShowsTheRateAndForSoLong) {
  LinkEstimate link;
  int64_t time_ns = kSInNs;
  link.on_round_trip(20 * kMsInNs, time_ns);
  EXPECT_EQ(link.capacity_bytes_per_s(time_ns), 0.0);
  EXPECT_EQ(link.transfer_ns(1'000'000, time_ns), 0);
  // 100 kB in a second beyond the bare 20 ms.
  time_ns += 2 * kSInNs;
  link.on_acked({100'000, time_ns - 1'020 * kMsInNs, true, true}, time_ns);
  EXPECT_NEAR(link.capacity_bytes_per_s(time_ns), 100e3, 1.0);
  EXPECT_NEAR(static_cast<double>(link.transfer_ns(50'000, time_ns)), 0.5e9, 1e4);
  EXPECT_GT(link.capacity_bytes_per_s(time_ns + kCapacityAgeNs), 0.0);
  EXPECT_EQ(link.capacity_bytes_per_s(time_ns + kCapacityAgeNs + 1), 0.0);
}

// The client compiles, say, before it answers; it noted when the frame came.
TEST(LinkEstimate, ALateAnswerToALargeFrameIsNoSlowLink) {
  for (const bool tells_times : {true, false}) {
    LinkEstimate link;
    int64_t time_ns = kSInNs;
    constexpr int64_t kClockNs = 77 * kSInNs;  // of the client's clock before ours
    const auto received = [&](int64_t at_ns) { return tells_times ? at_ns + kClockNs : 0; };
    link.on_round_trip(20 * kMsInNs, time_ns);
    time_ns += kSInNs;
    link.on_acked({100, time_ns - 20 * kMsInNs, false, true, {received(time_ns - 10 * kMsInNs)}}, time_ns);
    // 100 kB in half a second, and an answer a second later.
    const int64_t sent_ns = time_ns += kSInNs;
    time_ns += 1'520 * kMsInNs;
    link.on_acked({100'000, sent_ns, true, true, {received(sent_ns + 510 * kMsInNs)}}, time_ns);
    EXPECT_NEAR(link.capacity_bytes_per_s(time_ns), tells_times ? 200e3 : 66.7e3, 1e2);
  }
}

TEST(LinkEstimate, SmallFramesOnAFreeLinkSayNothingOfItsRate) {
  LinkEstimate link;
  int64_t time_ns = kSInNs;
  for (int i = 0; i < 600; ++i) {
    time_ns += 16 * kMsInNs;
    EXPECT_EQ(link.on_acked(took(20, time_ns), time_ns), 0) << "and wait for nothing";
  }
  EXPECT_EQ(link.capacity_bytes_per_s(time_ns), 0.0);
}

TEST(LinkEstimate, AQueueShowsTheRateAndTheDelayIsWhatIsBeyondTheBareLink) {
  LinkEstimate link;
  constexpr size_t kBytes = 5'000;
  int64_t time_ns = kSInNs;
  link.on_round_trip(20 * kMsInNs, time_ns);
  // One frame of 5 kB each 50 ms is what the link carries; each has waited for half a second.
  int64_t delay_ns = 0;
  for (int i = 0; i < 40; ++i) {
    time_ns += 50 * kMsInNs;
    delay_ns = link.on_acked(took(570, time_ns, kBytes), time_ns);
  }
  EXPECT_NEAR(link.capacity_bytes_per_s(time_ns), 100e3, 1e3);
  EXPECT_NEAR(static_cast<double>(delay_ns), 500e6, 2e6) << "570 less 20 of the link and 50 of its own";
}

TEST(LinkEstimate, ADelayIsNeverNegative) {
  LinkEstimate link;
  int64_t time_ns = kSInNs;
  for (const int64_t ms : {200, 5, 300, 1, 0}) {
    time_ns += kSInNs;
    EXPECT_GE(link.on_acked(took(ms, time_ns), time_ns), 0) << ms;
  }
}

TEST(LinkEstimate, APathThatBecameLongerIsBelievedOfAFrameThatMetNothing) {
  LinkEstimate link;
  int64_t time_ns = kSInNs;
  link.on_round_trip(20 * kMsInNs, time_ns);
  time_ns += kLongerPathNs + kMsInNs;
  const AckedFrame alone{100, time_ns - 400 * kMsInNs, false, true};
  EXPECT_EQ(link.on_acked(alone, time_ns), 0) << "a longer way is no queue";
  EXPECT_EQ(link.base_ns(), 400 * kMsInNs);
}

/// As its client tells it: received at the end of the way there, by a clock of its own.
AckedFrame told(const AckedFrame& frame, int64_t received_ns) {
  AckedFrame with_times = frame;
  with_times.client = {received_ns + 1'000 * kSInNs, kMsInNs};
  return with_times;
}

TEST(LinkEstimate, WhatTheClientWasNotThereForIsNoDelayOfTheLink) {
  LinkEstimate link;
  int64_t time_ns = kSInNs;
  link.on_round_trip(20 * kMsInNs, time_ns);
  // A frame each 16 ms; the client looks every 320 ms and acknowledges what lies there, 1 ms each.
  for (int look = 0; look < 20; ++look) {
    time_ns += 320 * kMsInNs;
    for (int i = 0; i < 20; ++i) {
      const int64_t sent_ns = time_ns - (20 - i) * 16 * kMsInNs - 10 * kMsInNs;
      const int64_t delay_ns =
          link.on_acked(told({400, sent_ns, false, false}, time_ns + i), time_ns + (10 + i) * kMsInNs);
      EXPECT_GE(delay_ns, (20 - i) * 15 * kMsInNs) << "in all";
      EXPECT_LE(link.link_delay_ns(), kLowDelayNs) << look << ", " << i;
    }
  }
  EXPECT_EQ(link.capacity_bytes_per_s(time_ns), 0.0) << "the link was not the limit";
}

TEST(LinkEstimate, AQueueIsADelayOfTheLinkWhateverTheClientTells) {
  LinkEstimate link;
  int64_t time_ns = kSInNs;
  link.on_round_trip(20 * kMsInNs, time_ns);
  link.on_acked(told({100, time_ns - 20 * kMsInNs, false, false}, time_ns - 10 * kMsInNs), time_ns);
  for (int i = 0; i < 40; ++i) {
    time_ns += 50 * kMsInNs;
    link.on_acked(told(took(570, time_ns, 5'000), time_ns - 10 * kMsInNs), time_ns);
  }
  EXPECT_GE(link.link_delay_ns(), 400 * kMsInNs);
  EXPECT_NEAR(link.capacity_bytes_per_s(time_ns), 100e3, 5e3);
  // And when it has got fast again, nothing of that stays.
  for (int i = 0; i < 600; ++i) {
    time_ns += 66 * kMsInNs;
    AckedFrame alone = took(320, time_ns, 2'000);
    alone.was_alone = true;
    link.on_acked(told(alone, time_ns - 160 * kMsInNs), time_ns);
  }
  EXPECT_LE(link.link_delay_ns(), kLowDelayNs);
  EXPECT_EQ(link.capacity_bytes_per_s(time_ns), 0.0);
}

TEST(LinkEstimate, AClientWhoseTimesMakeNoSenseIsTakenByOurs) {
  constexpr int64_t kLast = std::numeric_limits<int64_t>::max();
  for (const auto& times : std::vector<std::pair<int64_t, int64_t>>{
           {0, 0}, {1, 1}, {5, 4}, {-1, -2}, {kLast, kLast}, {kLast, -1}}) {
    LinkEstimate told_link, link;
    int64_t time_ns = kSInNs;
    for (LinkEstimate* one : {&told_link, &link}) one->on_round_trip(20 * kMsInNs, time_ns);
    for (int i = 0; i < 40; ++i) {
      time_ns += 50 * kMsInNs;
      AckedFrame frame = took(570, time_ns, 5'000);
      link.on_acked(frame, time_ns);
      frame.client.received_ns = i % 2 == 0 ? times.first : times.second;
      told_link.on_acked(frame, time_ns);
    }
    EXPECT_EQ(told_link.link_delay_ns(), link.link_delay_ns()) << times.first << ", " << times.second;
    EXPECT_NEAR(told_link.capacity_bytes_per_s(time_ns), link.capacity_bytes_per_s(time_ns), 1.0);
  }
}

}  // namespace
}  // namespace strandcast::link_estimate_test
