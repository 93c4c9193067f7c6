#include "server/input/input_hub.h"
#include "common/base/units.h"

#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <thread>
#include <utility>

namespace strandcast::input_hub_test {
namespace {
constexpr int64_t kStart = 5'000'000 * kMsInNs;  // some server time
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

Pose pose_at(double x_m, double yaw_rad = 0.0) {
  return {{x_m, 0.0, 0.0}, glm::angleAxis(yaw_rad, glm::dvec3(0, 1, 0))};
}

MotionSamples motion(int64_t time_ns, const Pose& pose) {
  return {{{time_ns, pose}}};
}
WindSamples wind(int64_t time_ns, const glm::vec3& velocity_mps) {
  return {{{time_ns, velocity_mps}}};
}

TEST(InputHub, StartsWithoutMotionOrWind) {
  InputHub hub;
  const InputFrame frame = hub.sample(kStart);
  EXPECT_FALSE(frame.has_motion);
  EXPECT_FALSE(frame.has_wind_stream);
  EXPECT_TRUE(frame.is_motion_stale);
  EXPECT_FALSE(frame.has_teleported);
  EXPECT_EQ(frame.motion_time_ns, 0);
  EXPECT_EQ(frame.world_from_head, Pose{});
}

TEST(InputHub, HoldsTheNewestSampleWithoutDelay) {
  InputHub hub;
  hub.push(1, motion(0, pose_at(0.0)), kStart);
  hub.push(1, motion(10 * kMsInNs, pose_at(0.1)), kStart + 10 * kMsInNs);
  const InputFrame frame = hub.sample(kStart + 10 * kMsInNs);
  EXPECT_EQ(frame.world_from_head, pose_at(0.1));
  EXPECT_EQ(frame.motion_time_ns, kStart + 10 * kMsInNs) << "arrival of the newest sample used";
  EXPECT_EQ(hub.sample(kStart + 300 * kMsInNs).world_from_head, pose_at(0.1));
  EXPECT_EQ(hub.sample(kStart + 300 * kMsInNs).motion_time_ns, kStart + 10 * kMsInNs);
}

TEST(InputHub, ADelayedSourceIsShownBetweenItsSamples) {
  InputHub hub;
  hub.set_delay(1, 10 * kMsInNs);
  for (int i = 0; i < 10; ++i)
    hub.push(1, motion(i * 10 * kMsInNs, pose_at(0.1 * i)), kStart + i * 10 * kMsInNs);
  EXPECT_NEAR(hub.sample(kStart + 90 * kMsInNs).world_from_head.position_m.x, 0.8, 1e-12);
  EXPECT_NEAR(hub.sample(kStart + 95 * kMsInNs).world_from_head.position_m.x, 0.85, 1e-12);
  EXPECT_NEAR(hub.sample(kStart + 100 * kMsInNs).world_from_head.position_m.x, 0.9, 1e-12) << "the newest";
  // Of this source alone, and not for ever.
  hub.remove_source(1);
  hub.push(2, motion(0, pose_at(1.0)), kStart + 200 * kMsInNs);
  hub.push(2, motion(10 * kMsInNs, pose_at(2.0)), kStart + 210 * kMsInNs);
  EXPECT_EQ(hub.sample(kStart + 210 * kMsInNs).world_from_head, pose_at(2.0));
  hub.set_delay(2, 5 * kMsInNs);
  hub.set_delay(2, 0);
  hub.push(2, motion(20 * kMsInNs, pose_at(3.0)), kStart + 220 * kMsInNs);
  EXPECT_EQ(hub.sample(kStart + 220 * kMsInNs).world_from_head, pose_at(3.0));
}

TEST(InputHub, SaysHowFastItsOwnerPlaysTheMotion) {
  InputHub hub;
  EXPECT_EQ(hub.sample(kStart).motion_speed, 1.0);
  MotionSamples slowed = motion(0, pose_at(0.0));
  slowed.held_back = 0.75;
  hub.push(1, slowed, kStart);
  EXPECT_EQ(hub.sample(kStart).motion_speed, 0.25);
  slowed.held_back = 0.5;
  hub.push(2, slowed, kStart + kMsInNs);
  EXPECT_EQ(hub.sample(kStart + kMsInNs).motion_speed, 0.25) << "another source drives the head";
  hub.push(1, motion(10 * kMsInNs, pose_at(0.0)), kStart + 10 * kMsInNs);
  EXPECT_EQ(hub.sample(kStart + 10 * kMsInNs).motion_speed, 1.0);
}

TEST(InputHub, InterpolatesBetweenSamples) {
  InputHub hub;
  hub.push(1, motion(0, pose_at(0.0, 0.0)), kStart);
  hub.push(1, motion(20 * kMsInNs, pose_at(0.2, 0.4)), kStart + 20 * kMsInNs);
  const InputFrame frame = hub.sample(kStart + 5 * kMsInNs);
  EXPECT_NEAR(frame.world_from_head.position_m.x, 0.05, 1e-12);
  EXPECT_NEAR(angle_between_rad(frame.world_from_head.rotation, pose_at(0, 0.1).rotation), 0.0, 1e-9);
  EXPECT_EQ(frame.motion_time_ns, kStart + 20 * kMsInNs);
}

TEST(InputHub, NetworkJitterDoesNotReachThePose) {
  // 120 Hz samples of a head at 1 m/s, source clock far off, delays of 2 .. 22 ms; asked 30 ms behind.
  InputHub hub;
  std::mt19937 random(1);
  const int64_t source_offset = 777'777 * kMsInNs;
  struct Packet {
    int64_t arrival_ns, time_ns;
    double x_m;
  };
  std::vector<Packet> packets;
  int64_t last_arrival = 0;
  for (int i = 0; i < 600; ++i) {
    const int64_t true_ns = kStart + i * 25 * kMsInNs / 3;
    const int64_t arrival =
        std::max(last_arrival, true_ns + 2 * kMsInNs + static_cast<int64_t>(random() % 20) * kMsInNs);
    packets.push_back({arrival, true_ns - source_offset, static_cast<double>(true_ns - kStart) * 1e-9});
    last_arrival = arrival;  // TCP keeps the order
  }
  size_t next = 0;
  for (int64_t now = kStart + 2000 * kMsInNs; now < kStart + 4000 * kMsInNs; now += 7 * kMsInNs) {
    for (; next < packets.size() && packets[next].arrival_ns <= now; ++next)
      hub.push(1, motion(packets[next].time_ns, pose_at(packets[next].x_m)), packets[next].arrival_ns);
    const double x_m = hub.sample(now - 30 * kMsInNs).world_from_head.position_m.x;
    // The best delay of 2 ms stays in the mapping, up to one more when no sample was that fast.
    EXPECT_NEAR(x_m, static_cast<double>(now - 30 * kMsInNs - 2 * kMsInNs - kStart) * 1e-9, 0.0011);
  }
  EXPECT_EQ(hub.counters().rejected(), 0u);
}

TEST(InputHub, SaysWhenMotionIsStaleAndKeepsThePose) {
  InputHub hub;
  hub.push(1, motion(0, pose_at(0.5)), kStart);
  EXPECT_FALSE(hub.sample(kStart).is_motion_stale);
  EXPECT_FALSE(hub.sample(kStart + kMotionStaleNs).is_motion_stale);
  const InputFrame stale = hub.sample(kStart + kMotionStaleNs + 1);
  EXPECT_TRUE(stale.is_motion_stale);
  EXPECT_TRUE(stale.has_motion);
  EXPECT_EQ(stale.world_from_head, pose_at(0.5));
  hub.push(1, motion(2000 * kMsInNs, pose_at(0.5)), kStart + 2000 * kMsInNs);
  EXPECT_FALSE(hub.sample(kStart + 2000 * kMsInNs).is_motion_stale);
}

TEST(InputHub, LateAndDuplicateSamplesAreCountedAndChangeNothing) {
  InputHub hub;
  hub.push(1, motion(0, pose_at(0.0)), kStart);
  hub.push(1, motion(20 * kMsInNs, pose_at(0.2)), kStart + 20 * kMsInNs);
  hub.push(1, motion(10 * kMsInNs, pose_at(0.15)),
           kStart + 21 * kMsInNs);  // late on the way, but nothing newer was used
  EXPECT_NEAR(hub.sample(kStart + 10 * kMsInNs).world_from_head.position_m.x, 0.15, 1e-12);
  hub.push(1, motion(20 * kMsInNs, pose_at(9.0)), kStart + 22 * kMsInNs);
  EXPECT_EQ(hub.counters().duplicate, 1u);
  const InputFrame before = hub.sample(kStart + 30 * kMsInNs);
  EXPECT_EQ(before.world_from_head, pose_at(0.2));
  hub.push(1, motion(19 * kMsInNs, pose_at(9.0)), kStart + 31 * kMsInNs);
  hub.push(1, motion(20 * kMsInNs, pose_at(9.0)), kStart + 31 * kMsInNs);
  const InputFrame after = hub.sample(kStart + 31 * kMsInNs);
  EXPECT_EQ(after.world_from_head, before.world_from_head);
  EXPECT_EQ(hub.counters().late, 1u);
  EXPECT_EQ(hub.counters().duplicate, 2u);
  EXPECT_EQ(after.rejected_samples, 3u);
}

TEST(InputHub, ImpossibleSamplesAreRefusedAndDoNotTakeTheHead) {
  InputHub hub;
  const glm::dquat upright(1, 0, 0, 0);
  const std::vector<Pose> bad{
      {{kNan, 0, 0}, upright},      {{0, kInf, 0}, upright},      {{0, 0, 0}, {kNan, 0, 0, 0}},
      {{0, 0, 0}, {0, 0, 0, 0}},    {{0, 0, 0}, {0.49, 0, 0, 0}}, {{0, 0, 0}, {0, 0, 2.01, 0}},
      {{0, 0, 0}, {0, kInf, 0, 0}}, {{1e4, 1e3, 0}, upright},     {{1e308, 1e308, 1e308}, upright}};
  for (const Pose& pose : bad) hub.push(1, motion(0, pose), kStart);
  hub.push(1, motion(std::numeric_limits<int64_t>::max(), pose_at(0)), kStart);
  hub.push(1, motion(std::numeric_limits<int64_t>::min(), pose_at(0)), kStart);
  EXPECT_EQ(hub.counters().impossible, bad.size() + 2);
  EXPECT_FALSE(hub.sample(kStart).has_motion);
  hub.push(2, motion(0, {{1, 0, 0}, {0, 1.9, 0, 0}}), kStart);
  const InputFrame frame = hub.sample(kStart);
  EXPECT_TRUE(frame.has_motion);
  EXPECT_NEAR(glm::length(frame.world_from_head.rotation), 1.0, 1e-12) << "normalised";
  EXPECT_EQ(hub.counters().not_owner, 0u);

  for (const glm::vec3& v : {glm::vec3(std::nanf(""), 0, 0), glm::vec3(0, INFINITY, 0), glm::vec3(0, 0, 201)})
    hub.push(1, wind(0, v), kStart);
  EXPECT_EQ(hub.counters().impossible, bad.size() + 5);
  EXPECT_FALSE(hub.sample(kStart).has_wind_stream);
}

TEST(InputHub, TeleportsAreFlaggedOnceAndNotInterpolated) {
  for (const Pose& far : {pose_at(1.2), pose_at(0.0, 2.5)}) {  // 60 m/s; 125 rad/s
    InputHub hub;
    hub.push(1, motion(0, pose_at(0.0)), kStart);
    EXPECT_TRUE(hub.sample(kStart).has_teleported) << "the first pose replaces none";
    hub.push(1, motion(20 * kMsInNs, far), kStart + 20 * kMsInNs);
    const InputFrame between = hub.sample(kStart + 10 * kMsInNs);
    EXPECT_EQ(between.world_from_head, pose_at(0.0));
    EXPECT_FALSE(between.has_teleported);
    const InputFrame there = hub.sample(kStart + 20 * kMsInNs);
    EXPECT_EQ(there.world_from_head.position_m, far.position_m);
    EXPECT_TRUE(there.has_teleported);
    EXPECT_FALSE(hub.sample(kStart + 21 * kMsInNs).has_teleported);
  }
}

TEST(InputHub, AJumpAcrossSkippedSamplesOrAGapIsStillATeleport) {
  InputHub hub;
  hub.push(1, motion(0, pose_at(0.0)), kStart);
  hub.sample(kStart);
  hub.push(1, motion(1 * kMsInNs, pose_at(0.5)), kStart + 1 * kMsInNs);  // 500 m/s there
  hub.push(1, motion(2 * kMsInNs, pose_at(0.0)), kStart + 2 * kMsInNs);  // and back
  EXPECT_TRUE(hub.sample(kStart + 16 * kMsInNs).has_teleported);
  // A gap of 5 s hides the speed between samples, but the strands see the jump between two frames.
  hub.sample(kStart + 5000 * kMsInNs);
  hub.push(1, motion(5010 * kMsInNs, pose_at(2.0)), kStart + 5010 * kMsInNs);
  EXPECT_TRUE(hub.sample(kStart + 5016 * kMsInNs).has_teleported);
}

/// How much the speed changes from one frame to the next, of 60 a second, of a head at 1 m/s. Its samples, so
/// many a second, take 0 to 6 ms on the way. The first second, in which the delay is found, is left out.
double most_uneven_mps(double rate_hz) {
  constexpr double kFrameS = 1.0 / 60.0;
  InputHub hub;
  std::mt19937 random(5);
  std::vector<double> shown_m;
  int64_t next = 0, arrival_ns = 0, last_ns = 0;
  for (int frame = 0; frame < 300; ++frame) {
    const auto now_ns = static_cast<int64_t>(frame * kFrameS * 1e9);
    while (true) {
      const auto made_ns = static_cast<int64_t>(static_cast<double>(next) / rate_hz * 1e9);
      if (arrival_ns == 0)
        arrival_ns = std::max(last_ns, made_ns + static_cast<int64_t>(random() % 7) * kMsInNs);
      if (arrival_ns > now_ns) break;
      hub.push(1, motion(made_ns, pose_at(static_cast<double>(made_ns) * 1e-9)), kStart + arrival_ns);
      last_ns = std::exchange(arrival_ns, 0);
      ++next;
    }
    shown_m.push_back(hub.sample(kStart + now_ns).world_from_head.position_m.x);
  }
  double most_mps = 0.0;
  for (size_t i = 62; i < shown_m.size(); ++i)
    most_mps = std::max(most_mps, std::abs(shown_m[i] - 2.0 * shown_m[i - 1] + shown_m[i - 2]) / kFrameS);
  return most_mps;
}

// Samples fall unevenly into frames: as their newest the head would stand in one frame and make up for it in
// the next, which is 6 g at a walk. The counter-example: samples too far apart to wait for are held.
TEST(InputHub, AHeadWhoseSamplesComeUnevenlyMovesEvenly) {
  EXPECT_LT(most_uneven_mps(120.0), 0.2);
  EXPECT_LT(most_uneven_mps(50.0), 0.2) << "fewer samples than frames";
  EXPECT_GT(most_uneven_mps(20.0), 0.9);
}

TEST(InputHub, AHeadWithoutItsSourceIsCutOnce) {
  InputHub hub;
  hub.push(1, motion(0, pose_at(0.0)), kStart);
  hub.sample(kStart);
  hub.push(1, motion(16 * kMsInNs, pose_at(0.03)), kStart + 16 * kMsInNs);
  EXPECT_FALSE(hub.sample(kStart + 16 * kMsInNs).has_teleported);
  hub.remove_source(2);
  const InputFrame before = hub.sample(kStart + 33 * kMsInNs);
  EXPECT_FALSE(before.has_teleported) << "it did not drive the head";
  hub.remove_source(1);
  const InputFrame left = hub.sample(kStart + 50 * kMsInNs);
  EXPECT_TRUE(left.has_teleported) << "no head stops from one step to the next";
  EXPECT_EQ(left.world_from_head, before.world_from_head);
  EXPECT_FALSE(hub.sample(kStart + 66 * kMsInNs).has_teleported);
}

// The counter-example: a frame has shown the last pose, and the head rests where that frame had it.
TEST(InputHub, WhatASourceSaidLastIsShownThoughItLeftBeforeTheNextFrame) {
  for (const bool is_held : {false, true}) {
    InputHub hub;
    if (is_held) hub.hold_samples();
    hub.push(1, motion(0, pose_at(0.0)), kStart);
    hub.sample(kStart);
    hub.push(1, motion(8 * kMsInNs, pose_at(0.01)), kStart + 8 * kMsInNs);
    hub.push(1, motion(15 * kMsInNs, pose_at(0.02)), kStart + 15 * kMsInNs);
    hub.remove_source(1);
    const InputFrame left = hub.sample(kStart + 16 * kMsInNs);
    EXPECT_EQ(left.world_from_head, pose_at(0.02));
    EXPECT_TRUE(left.is_motion_stale);
    EXPECT_EQ(hub.sample(kStart + 33 * kMsInNs).world_from_head, pose_at(0.02));
  }
  InputHub hub;
  hub.push(1, motion(0, pose_at(0.5)), kStart);
  hub.remove_source(1);
  EXPECT_TRUE(hub.sample(kStart).has_motion) << "the only one that ever came";
  EXPECT_EQ(hub.sample(kStart).world_from_head, pose_at(0.5));
}

/// What 60 frames a second show of a head at 1 m/s whose samples come so far apart, and in bursts of so many;
/// for 300 ms in the middle none come.
struct Shown {
  double fastest_mps = 0.0;  // from frame to frame
  double most_mps2 = 0.0;    // likewise, from the second second on
  double held_mps2 = 0.0;    // likewise, of a head that is held where it was heard of last
  uint64_t teleports = 0;    // after the first pose
  double behind_m = 0.0;     // its source, in the end
};

/// A head's acceleration over its last three frames.
class Acceleration {
 public:
  double add_mps2(double x_m, double frame_s) {
    const double mps = (x_m - before_m_) / frame_s;
    before_m_ = x_m;
    return std::abs(mps - std::exchange(before_mps_, mps)) / frame_s;
  }

 private:
  double before_m_ = 0.0, before_mps_ = 0.0;
};

Shown shown_across_a_stall(int64_t spacing_ns, int per_burst) {
  constexpr int64_t kFrameNs = 1'000'000'000 / 60, kStallFromNs = 2000 * kMsInNs, kStallNs = 300 * kMsInNs;
  constexpr double kFrameS = static_cast<double>(kFrameNs) * 1e-9;
  InputHub hub;
  Shown shown;
  Acceleration of_shown, of_held;
  std::optional<double> before_m;
  double held_m = 0.0, x_m = 0.0;
  int64_t next_ns = 0;
  MotionSamples waiting;
  for (int64_t now_ns = 0; now_ns < 4000 * kMsInNs; now_ns += kFrameNs) {
    for (; next_ns <= now_ns; next_ns += spacing_ns) {
      if (next_ns >= kStallFromNs && next_ns < kStallFromNs + kStallNs) continue;
      waiting.samples.push_back({next_ns, pose_at(static_cast<double>(next_ns) * 1e-9)});
      if (waiting.samples.size() < static_cast<size_t>(per_burst)) continue;
      held_m = waiting.samples.back().world_from_head.position_m.x;
      hub.push(1, std::exchange(waiting, {}), kStart + next_ns);
    }
    const InputFrame frame = hub.sample(kStart + now_ns);
    if (!frame.has_motion) continue;
    x_m = frame.world_from_head.position_m.x;
    if (before_m) shown.fastest_mps = std::max(shown.fastest_mps, (x_m - *before_m) / kFrameS);
    if (frame.has_teleported && before_m) ++shown.teleports;
    const double mps2 = of_shown.add_mps2(x_m, kFrameS), held_mps2 = of_held.add_mps2(held_m, kFrameS);
    if (now_ns > 1000 * kMsInNs) {
      shown.most_mps2 = std::max(shown.most_mps2, mps2);
      shown.held_mps2 = std::max(shown.held_mps2, held_mps2);
    }
    before_m = x_m;
  }
  shown.behind_m = held_m - x_m;
  return shown;
}

// Samples that frames are no multiples of let an even head waver by some 1 m/s^2. Held, the head would stop
// dead and leap.
TEST(InputHub, AHeadWhoseSourceFallsSilentSlowsAndComesBackGently) {
  constexpr int64_t kSpacingNs = 1'000'000'000 / 120;
  for (const int64_t spacing_ns : {kSpacingNs, 2 * kSpacingNs}) {
    const Shown shown = shown_across_a_stall(spacing_ns, 1);
    EXPECT_LT(shown.most_mps2, kEasyStart.mps2 + 1.0) << spacing_ns;
    EXPECT_LT(shown.fastest_mps, 2.0) << spacing_ns;
    EXPECT_NEAR(shown.behind_m, 0.0, kMostSteadiedSpacings * static_cast<double>(spacing_ns) * 1e-9);
    EXPECT_GT(shown.held_mps2, 10.0 * kEasyStart.mps2) << spacing_ns;
  }
}

TEST(InputHub, ASilentHeadStaysInTheWorld) {
  constexpr int64_t kFrameNs = 1'000'000'000 / 60;
  InputHub hub;
  for (int i = 0; i < 120; ++i) {
    // It is heard of until it is 5 mm from the edge, at 3 m/s.
    const double x_m = kMaxHeadDistanceM - 0.005 - 0.05 * (59 - i);
    if (i < 60) hub.push(1, motion(i * kFrameNs, pose_at(x_m)), kStart + i * kFrameNs);
    EXPECT_LE(hub.sample(kStart + i * kFrameNs).world_from_head.position_m.x, kMaxHeadDistanceM) << i;
  }
}

TEST(InputHub, CatchingUpAfterAStallIsATeleport) {
  EXPECT_EQ(shown_across_a_stall(25 * kMsInNs / 3, 1).teleports, 1u)
      << "strands feel the speed of the source that is back over a second";
}

// The counter-example: of sources whose samples always come so far apart all motion is felt.
TEST(InputHub, SamplesThatAreUsuallyFarApartAreFelt) {
  EXPECT_EQ(shown_across_a_stall(200 * kMsInNs, 1).teleports, 0u) << "5 samples a second";
  EXPECT_EQ(shown_across_a_stall(10 * kMsInNs, 20).teleports, 0u) << "bursts of 20, 5 a second";
}

TEST(InputHub, AHeadThatComesBackFarAwayJumps) {
  constexpr int64_t kFrameNs = 1'000'000'000 / 60;
  InputHub hub;
  for (int i = 0; i < 60; ++i) {
    hub.push(1, motion(i * kFrameNs, pose_at(0.0)), kStart + i * kFrameNs);
    hub.sample(kStart + i * kFrameNs);
  }
  for (int i = 60; i < 90; ++i) hub.sample(kStart + i * kFrameNs);
  hub.push(1, motion(90 * kFrameNs, pose_at(3.0)), kStart + 90 * kFrameNs);
  const InputFrame back = hub.sample(kStart + 90 * kFrameNs);
  EXPECT_NEAR(back.world_from_head.position_m.x, 3.0, 0.1) << "shown as late as its samples come";
  EXPECT_TRUE(back.has_teleported);
}

TEST(InputHub, AnotherSourcesFirstPoseIsATeleport) {
  InputHub hub;
  hub.push(1, motion(0, pose_at(0.0)), kStart);
  EXPECT_TRUE(hub.sample(kStart).has_teleported);
  hub.remove_source(1);
  hub.push(2, motion(0, pose_at(0.05)), kStart + 100 * kMsInNs);
  EXPECT_TRUE(hub.sample(kStart + 100 * kMsInNs).has_teleported) << "0.5 m/s, but it is another head";
  hub.push(2, motion(16 * kMsInNs, pose_at(0.1)), kStart + 116 * kMsInNs);
  EXPECT_FALSE(hub.sample(kStart + 116 * kMsInNs).has_teleported) << "the same way of one source is felt";
}

TEST(InputHub, FastHumanMotionIsNoTeleport) {
  InputHub hub;
  hub.push(1, motion(0, pose_at(0.0)), kStart);
  hub.sample(kStart);
  for (int i = 1; i < 200; ++i) {  // 10 m/s and 35 rad/s, beyond any person
    const double t = i * 0.0083333;
    const auto time_ns = static_cast<int64_t>(t * 1e9);
    hub.push(1, motion(time_ns, pose_at(10.0 * t, 35.0 * t)), kStart + time_ns);
    EXPECT_FALSE(hub.sample(kStart + time_ns).has_teleported) << i;
  }
}

TEST(InputHub, RotationsStayInOneHemisphere) {
  InputHub hub;
  glm::dquat last(1, 0, 0, 0);
  for (int i = 0; i < 400; ++i) {  // two turns, with the sign of every other sample flipped
    Pose pose = pose_at(0.0, i * 0.03);
    if (i % 2) pose.rotation = -pose.rotation;
    hub.push(1, motion(i * 10 * kMsInNs, pose), kStart + i * 10 * kMsInNs);
    const glm::dquat rotation = hub.sample(kStart + i * 10 * kMsInNs - 4 * kMsInNs).world_from_head.rotation;
    EXPECT_GT(glm::dot(rotation, last), 0.99) << i;
    last = rotation;
  }
}

TEST(InputHub, FirstSourceOwnsTheHeadUntilStaleOrRemoved) {
  InputHub hub;
  hub.push(1, motion(0, pose_at(0.1)), kStart);
  hub.push(2, motion(0, pose_at(0.2)), kStart + 1 * kMsInNs);
  EXPECT_EQ(hub.sample(kStart + 2 * kMsInNs).world_from_head, pose_at(0.1));
  EXPECT_EQ(hub.counters().not_owner, 1u);
  hub.push(2, motion(1000 * kMsInNs, pose_at(0.2)), kStart + kMotionStaleNs);
  EXPECT_EQ(hub.sample(kStart + kMotionStaleNs).world_from_head, pose_at(0.1));
  hub.push(2, motion(1001 * kMsInNs, pose_at(0.2)), kStart + kMotionStaleNs + 1);
  EXPECT_EQ(hub.sample(kStart + kMotionStaleNs + 1).world_from_head, pose_at(0.2));
  hub.push(1, motion(1002 * kMsInNs, pose_at(0.1)), kStart + kMotionStaleNs + 2);
  EXPECT_EQ(hub.counters().not_owner, 3u) << "the first one has lost the head";
  hub.remove_source(1);
  EXPECT_FALSE(hub.sample(kStart + kMotionStaleNs + 3).is_motion_stale);
  hub.remove_source(2);
  const InputFrame removed = hub.sample(kStart + kMotionStaleNs + 3);
  EXPECT_TRUE(removed.is_motion_stale);
  EXPECT_EQ(removed.world_from_head, pose_at(0.2));
  hub.push(3, motion(-55, pose_at(0.3)), kStart + kMotionStaleNs + 4);
  EXPECT_EQ(hub.sample(kStart + kMotionStaleNs + 4).world_from_head, pose_at(0.3));
}

TEST(InputHub, AStepOfTheSourceClockRestartsItsMapping) {
  for (const int64_t step : {-3'600'000 * kMsInNs, 3'600'000 * kMsInNs}) {
    InputHub hub;
    int64_t shift = 0;
    for (int i = 0; i < 100; ++i) {
      if (i == 50) shift = step;
      const int64_t now = kStart + i * 10 * kMsInNs;
      hub.push(1, motion(i * 10 * kMsInNs + shift, pose_at(0.01 * i)), now);
      EXPECT_NEAR(hub.sample(now).world_from_head.position_m.x, 0.01 * i, 1e-12) << "no freeze at " << i;
    }
    EXPECT_EQ(hub.counters().clock_restarts, 1u);
    EXPECT_EQ(hub.counters().rejected(), 0u);
  }
}

TEST(InputHub, FollowsASlowlyDriftingClock) {
  // 100 ppm fast or slow for two minutes: 12 ms in all; with a window of 10 s at most 1 ms of it shows.
  for (const double drift : {-1e-4, 1e-4}) {
    InputHub hub;
    double worst_m = 0.0;
    for (int i = 0; i < 12'000; ++i) {
      const int64_t now = kStart + i * 10 * kMsInNs;
      const double t = i * 0.01;
      hub.push(1, motion(static_cast<int64_t>(t * (1.0 + drift) * 1e9), pose_at(std::fmod(t, 50.0))), now);
      const double x_m = hub.sample(now - 5 * kMsInNs).world_from_head.position_m.x;
      if (std::fmod(t, 50.0) > 0.1) worst_m = std::max(worst_m, std::abs(x_m - (std::fmod(t, 50.0) - 0.005)));
    }
    EXPECT_LT(worst_m, 0.0012) << drift;
  }
}

TEST(InputHub, RateAndBuffersAreBounded) {
  InputHub hub;
  MotionSamples flood;
  for (int i = 0; i < 256; ++i) flood.samples.push_back({i * 10'000, pose_at(0.0)});
  for (int message = 0; message < 40; ++message) {
    for (auto& sample : flood.samples) sample.time_ns += 256 * 10'000;
    hub.push(1, flood, kStart + message * 25 * kMsInNs);  // 10,240 samples in a second
  }
  const InputCounters counters = hub.counters();
  EXPECT_LE(counters.accepted, 2000u) << "a burst of 1,000 and 1,000 per second";
  EXPECT_GE(counters.accepted, 1900u);
  EXPECT_EQ(counters.accepted + counters.over_rate, 10'240u);
  EXPECT_EQ(counters.dropped_oldest, counters.accepted - kMaxBufferedSamples);
  for (uint64_t source = 2; source < 500; ++source) hub.push(source, motion(0, pose_at(0)), kStart);
  EXPECT_EQ(hub.counters().not_owner, kMaxInputSources - 1) << "no memory for sources without end";
}

TEST(InputHub, AFullBufferForgetsItsOldest) {
  InputHub hub;
  constexpr int kSamples = 1'200;  // a millisecond and a millimetre apart
  static_assert(kSamples > kMaxBufferedSamples);
  MotionSamples samples;
  for (int i = 0; i < kSamples; ++i) {
    samples.samples.push_back({i * kMsInNs, pose_at(1e-3 * i)});
    if (samples.samples.size() < kSamples / 2) continue;
    hub.push(1, samples, kStart + i * kMsInNs);
    samples.samples.clear();
  }
  EXPECT_EQ(hub.counters().dropped_oldest, kSamples - kMaxBufferedSamples);
  EXPECT_EQ(hub.sample(kStart + kSamples * kMsInNs).world_from_head, pose_at(1e-3 * (kSamples - 1)));
}

// Two samples in one packet may be microseconds apart: that is the network's haste, not the head's.
TEST(InputHub, SamplesThatAreCloseTogetherAreNoTeleport) {
  InputHub hub;
  hub.push(1, motion(0, pose_at(0.0)), kStart);
  (void)hub.sample(kStart);
  hub.push(1, motion(10'000, pose_at(2e-3)), kStart + 16 * kMsInNs);
  hub.push(1, motion(20'000, pose_at(4e-3)), kStart + 16 * kMsInNs);
  EXPECT_FALSE(hub.sample(kStart + 16 * kMsInNs).has_teleported);
}

TEST(InputHub, TheWindStaysWithItsSourceUntilThatIsSilentForLong) {
  InputHub hub;
  hub.push(1, wind(0, {1.0f, 0.0f, 0.0f}), kStart);
  hub.push(2, wind(0, {2.0f, 0.0f, 0.0f}), kStart + kWindStaleNs - kMsInNs);
  EXPECT_EQ(hub.counters().not_owner, 1u);
  hub.push(2, wind(kMsInNs, {2.0f, 0.0f, 0.0f}), kStart + kWindStaleNs + kMsInNs);
  EXPECT_EQ(hub.counters().not_owner, 1u);
  EXPECT_EQ(hub.sample(kStart + kWindStaleNs + kMsInNs).wind_mps, glm::vec3(2.0f, 0.0f, 0.0f));
}

TEST(InputHub, WindStreamReplacesTheScenesWindWhileItLives) {
  InputHub hub;
  hub.push(7, wind(0, {1, 0, 0}), kStart);
  hub.push(7, wind(100 * kMsInNs, {3, 0, 0}), kStart + 100 * kMsInNs);
  hub.push(8, wind(100 * kMsInNs, {9, 9, 9}), kStart + 100 * kMsInNs);
  InputFrame frame = hub.sample(kStart + 50 * kMsInNs);
  EXPECT_TRUE(frame.has_wind_stream);
  EXPECT_FALSE(frame.has_motion);
  EXPECT_NEAR(frame.wind_mps.x, 2.0f, 1e-6);
  frame = hub.sample(kStart + 100 * kMsInNs + kWindStaleNs);
  EXPECT_EQ(frame.wind_mps, glm::vec3(3, 0, 0));
  EXPECT_FALSE(hub.sample(kStart + 101 * kMsInNs + kWindStaleNs).has_wind_stream);
  EXPECT_EQ(hub.counters().not_owner, 1u);
  hub.push(8, wind(0, {4, 0, 0}), kStart + 102 * kMsInNs + kWindStaleNs);
  EXPECT_TRUE(hub.sample(kStart + 102 * kMsInNs + kWindStaleNs).has_wind_stream);
  hub.remove_source(8);
  EXPECT_FALSE(hub.sample(kStart + 102 * kMsInNs + kWindStaleNs).has_wind_stream);
}

/// One random call sequence; numbers from tiny to impossible.
std::vector<InputFrame> play_garbage(uint32_t seed) {
  InputHub hub;
  std::mt19937_64 random(seed);
  const auto number = [&]() -> double {
    switch (random() % 12) {
      case 0:
        return kNan;
      case 1:
        return -kInf;
      case 2:
        return 1e300;
      case 3:
        return 0.0;
      default:
        return static_cast<double>(random() % 2001) * 1e-3 - 1.0;
    }
  };
  std::vector<InputFrame> frames;
  int64_t now = kStart;
  for (int i = 0; i < 400; ++i) {
    now += static_cast<int64_t>(random() % 40) * kMsInNs - 2 * kMsInNs;
    const uint64_t source = random() % 3;
    const int64_t time_ns = random() % 10 == 0 ? static_cast<int64_t>(random())
                                               : now - static_cast<int64_t>(random() % 100) * kMsInNs;
    MotionSamples samples;
    WindSamples winds;
    for (uint64_t k = 0; k < random() % 5; ++k) {
      const Pose pose{{number(), number(), number()}, {number(), number(), number(), number()}};
      samples.samples.push_back(
          {time_ns + static_cast<int64_t>(k) * kMsInNs, random() % 2 ? pose : pose_at(0.001 * i)});
      winds.samples.push_back({time_ns, {static_cast<float>(number()), 0.0f, static_cast<float>(number())}});
    }
    hub.push(source, samples, now);
    hub.push(source, winds, now);
    if (random() % 30 == 0) hub.remove_source(source);
    frames.push_back(hub.sample(random() % 50 ? now : static_cast<int64_t>(random())));
  }
  return frames;
}

TEST(InputHub, GarbageNeverReachesAFrameAndReplaysTheSame) {
  for (uint32_t seed = 0; seed < 100; ++seed) {
    const auto frames = play_garbage(seed);
    EXPECT_EQ(frames, play_garbage(seed));
    uint64_t rejected = 0;
    for (const InputFrame& frame : frames) {
      ASSERT_TRUE(is_finite(frame.world_from_head));
      ASSERT_NEAR(glm::length(frame.world_from_head.rotation), 1.0, 1e-9);
      ASSERT_LE(glm::length(frame.world_from_head.position_m), kMaxHeadDistanceM);
      ASSERT_TRUE(std::isfinite(glm::length(frame.wind_mps)));
      ASSERT_GE(frame.rejected_samples, rejected);
      rejected = frame.rejected_samples;
    }
    EXPECT_GT(rejected, 0u);
  }
}

TEST(InputHub, AnyThreadMayPushWhileAnotherSamples) {
  InputHub hub;
  std::thread source([&] {
    for (int i = 0; i < 900; ++i) {
      hub.push(1, motion(i * kMsInNs, pose_at(0.001 * i)), kStart + i * kMsInNs);
      hub.push(2, wind(i * kMsInNs, {1, 0, 0}), kStart + i * kMsInNs);
    }
    hub.remove_source(2);
  });
  for (int i = 0; i < 900; ++i) EXPECT_TRUE(is_finite(hub.sample(kStart + i * kMsInNs).world_from_head));
  source.join();
  EXPECT_EQ(hub.counters().accepted, 1800u - hub.counters().rejected());
  EXPECT_EQ(hub.sample(kStart + 900 * kMsInNs).world_from_head, pose_at(0.899));
}

/// A sample with joints of the body.
MotionSamples with_joints(int64_t time_ns, double x_m, const std::vector<glm::vec3>& joint_m,
                          const std::vector<std::string>& names = {"neck", "chest"}) {
  MotionSamples samples = motion(time_ns, pose_at(x_m));
  samples.samples[0].joint_m = joint_m;
  samples.joint_names = names;
  return samples;
}

TEST(InputHub, JointsGoWithTheHeadsSamples) {
  InputHub hub;
  EXPECT_TRUE(hub.sample(kStart).joints.name.empty());
  hub.push(1, with_joints(0, 0.0, {{0, 0, 0}, {1, 0, 0}}), kStart);
  hub.push(1, with_joints(10 * kMsInNs, 0.1, {{0, 0.5f, 0}, {1, 1, 0}}), kStart + kMsInNs);
  hub.push(2, with_joints(10 * kMsInNs, 0.1, {{2, 2, 2}, {2, 2, 2}}), kStart + kMsInNs);  // not the owner
  const int64_t offset_ns = kStart + kMsInNs - 10 * kMsInNs;  // by the fastest sample
  const InputFrame half = hub.sample(offset_ns + 5 * kMsInNs);
  EXPECT_EQ(half.joints.name, (std::vector<std::string>{"neck", "chest"}));
  ASSERT_EQ(half.joints.place_m.size(), 2u);
  EXPECT_NEAR(glm::distance(half.joints.place_m[0], glm::dvec3(0, 0.25, 0)), 0.0, 1e-6)
      << "between, as the head is";
  EXPECT_NEAR(half.world_from_head.position_m.x, 0.05, 1e-6);
  EXPECT_EQ(hub.sample(offset_ns + 10 * kMsInNs).joints.place_m[1], glm::dvec3(1, 1, 0));
  EXPECT_EQ(hub.counters().not_owner, 1u);
  // Other names, or none: nothing is between the two.
  hub.push(1, with_joints(20 * kMsInNs, 0.1, {{7, 0, 0}}, {"tail"}), kStart + 11 * kMsInNs);
  EXPECT_EQ(hub.sample(offset_ns + 15 * kMsInNs).joints.name.size(), 2u);
  EXPECT_EQ(hub.sample(offset_ns + 20 * kMsInNs).joints.name, std::vector<std::string>{"tail"});
  hub.push(1, motion(30 * kMsInNs, pose_at(0.1)), kStart + 21 * kMsInNs);
  EXPECT_TRUE(hub.sample(offset_ns + 30 * kMsInNs).joints.place_m.empty()) << "an older source";
}

TEST(InputHub, ImpossibleJointsAreRefusedWithTheirSample) {
  InputHub hub;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  hub.push(1, with_joints(0, 0.0, {{0, 0, 0}}), kStart);                 // two names
  hub.push(1, with_joints(1, 0.0, {{0, nan, 0}, {0, 0, 0}}), kStart);    // no number
  hub.push(1, with_joints(2, 0.0, {{0, 11.0f, 0}, {0, 0, 0}}), kStart);  // no body
  hub.push(1, with_joints(3, 0.0, {{0, 1, 0}, {0, 0, 0}}, {}), kStart);  // without names
  EXPECT_EQ(hub.counters().impossible, 4u);
  EXPECT_EQ(hub.counters().accepted, 0u);
}

TEST(InputHub, ASourceIsToldOnceWhyItsSamplesAreLeftOut) {
  InputHub hub;
  EXPECT_EQ(hub.push(1, motion(0, pose_at(0.1)), kStart), "");
  EXPECT_THAT(hub.push(1, motion(1, pose_at(2.0 * kMaxHeadDistanceM)), kStart + 1),
              testing::HasSubstr("the head is 2e+04 m from the origin, and 10000 m at most are believed"));
  EXPECT_EQ(hub.push(1, motion(2, pose_at(2.0 * kMaxHeadDistanceM)), kStart + 2), "");
  MotionSamples far = motion(1, pose_at(0.1));
  far.joint_names = {"neck"};
  far.samples.front().joint_m = {{0.0f, -40.0f, 0.0f}};
  EXPECT_THAT(hub.push(2, far, kStart + 3), testing::HasSubstr("a joint of the body is 40 m from the head"));
  EXPECT_THAT(hub.push(3, motion(1, pose_at(0.1)), kStart + 4),
              testing::HasSubstr("source 1 sends, and one at a time is heard"));
  EXPECT_EQ(hub.counters().rejected(), 4u);
}

}  // namespace
}  // namespace strandcast::input_hub_test
