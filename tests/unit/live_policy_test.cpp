// What every live input has to hold, whatever is sent: the head is always somewhere, in order of time, no
// faster than a head, and counts say what became of each pose. Time is virtual.
#include "server/input/live/live_policy.h"
#include "common/base/units.h"

#include <algorithm>
#include <numbers>
#include <random>

#include "server/input/input_hub.h"

namespace strandcast::live_policy_test {
namespace {
constexpr int64_t kStart = 1'000 * kMsInNs;
constexpr int64_t kPeriod = 16'666'667;

/// A head that walks and looks around, as fast as people do.
Pose walking(int64_t time_ns) {
  const double t_s = static_cast<double>(time_ns - kStart) * 1e-9;
  const glm::dvec3 place_m(0.4 * std::sin(1.3 * t_s), 1.6 + 0.03 * std::sin(9.0 * t_s), 0.3 * t_s);
  const glm::dquat turn = glm::angleAxis(0.8 * std::sin(2.1 * t_s), glm::dvec3(0, 1, 0)) *
                          glm::angleAxis(0.3 * std::sin(3.7 * t_s), glm::dvec3(1, 0, 0));
  return {place_m, turn};
}

LivePose live_pose(const Pose& pose) {
  LivePose live;
  live.world_from_subject = pose;
  return live;
}

/// Numbered, and with its time.
LivePose numbered(uint32_t frame) {
  LivePose live = live_pose(walking(kStart + frame * kPeriod));
  live.frame = frame;
  live.source_time_ns = frame * kPeriod;
  return live;
}

/// Asks as often as a receiver does, and keeps what comes.
class Stage {
 public:
  explicit Stage(bool turns_only = false) : policy(turns_only) {}
  void until(int64_t time_ns) {
    for (; now_ns < time_ns; now_ns += 5 * kMsInNs) keep(now_ns);
    now_ns = time_ns;
    keep(now_ns);
  }
  void send(const LivePose& pose, int64_t time_ns) {
    until(time_ns);
    policy.take(pose, time_ns);
    keep(time_ns);
  }
  /// From one output to any later one no more than a head moves, but for the jumps that are meant.
  void expect_no_faster_than_a_head() const {
    const double burst_s = static_cast<double>(kClampWindowNs) * 1e-9;
    for (size_t i = 0; i < heads.size(); ++i)
      for (size_t j = i + 1; j < std::min(heads.size(), i + 40); ++j) {
        const double passed_s = static_cast<double>(heads[j].time_ns - heads[i].time_ns) * 1e-9 + burst_s;
        const Pose& a = heads[i].world_from_head;
        const Pose& b = heads[j].world_from_head;
        ASSERT_LE(glm::distance(a.position_m, b.position_m), kMaxLiveSpeedMps * passed_s + 1e-9)
            << i << ' ' << j;
        ASSERT_LE(angle_between_rad(a.rotation, b.rotation), kMaxLiveTurnRadPerS * passed_s + 1e-9)
            << i << ' ' << j;
      }
  }
  void expect_always_somewhere() const {
    for (size_t i = 0; i < heads.size(); ++i) {
      ASSERT_TRUE(is_finite(heads[i].world_from_head)) << i;
      ASSERT_NEAR(glm::length(heads[i].world_from_head.rotation), 1.0, 1e-9) << i;
      if (i == 0) continue;
      ASSERT_GT(heads[i].time_ns, heads[i - 1].time_ns) << i;
      ASSERT_GE(glm::dot(heads[i].world_from_head.rotation, heads[i - 1].world_from_head.rotation), 0.0) << i;
    }
  }
  const Pose& last() const { return heads.back().world_from_head; }

  LivePolicy policy;
  std::vector<LiveHead> heads;
  int64_t now_ns = kStart;

 private:
  void keep(int64_t time_ns) {
    for (LiveHead& head : policy.advance(time_ns)) heads.push_back(std::move(head));
  }
};

/// No counter but those that are named.
void expect_counts(const LivePolicyCounters& found, const LivePolicyCounters& expected) {
  EXPECT_EQ(found.impossible, expected.impossible);
  EXPECT_EQ(found.clamped, expected.clamped);
  EXPECT_EQ(found.gated, expected.gated);
  EXPECT_EQ(found.resequenced, expected.resequenced);
  EXPECT_EQ(found.late, expected.late);
  EXPECT_EQ(found.lost, expected.lost);
}

TEST(LivePolicy, WhatIsRightPassesAsItIs) {
  Stage stage;
  for (uint32_t i = 0; i < 300; ++i) stage.send(numbered(i), kStart + i * kPeriod + 2 * kMsInNs);
  ASSERT_EQ(stage.heads.size(), 300u);
  for (uint32_t i = 0; i < 300; ++i) {
    EXPECT_EQ(stage.heads[i].time_ns, kStart + i * kPeriod + 2 * kMsInNs);
    EXPECT_LT(
        glm::distance(stage.heads[i].world_from_head.position_m, walking(kStart + i * kPeriod).position_m),
        1e-12);
    EXPECT_LT(
        angle_between_rad(stage.heads[i].world_from_head.rotation, walking(kStart + i * kPeriod).rotation),
        1e-7);
  }
  expect_counts(stage.policy.counters(), {});
}

TEST(LivePolicy, TimesAreThoseOfTheSourceWithoutItsJitter) {
  Stage stage;
  std::mt19937 random(3);
  for (uint32_t i = 0; i < 200; ++i)
    stage.send(numbered(i), kStart + i * kPeriod + static_cast<int64_t>(i == 0 ? 0 : random() % 8) * kMsInNs);
  for (uint32_t i = 0; i < 200; ++i) EXPECT_EQ(stage.heads[i].time_ns, kStart + i * kPeriod);
}

/// Everything at once, as a bad network and bad senders do it.
TEST(LivePolicy, WhateverComesTheHeadIsSomewhereAndNoFasterThanAHead) {
  constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
  for (uint32_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const auto chance = [&](uint32_t percent) { return random() % 100 < percent; };
    struct Sent {
      int64_t arrival_ns;
      LivePose pose;
    };
    std::vector<Sent> sent;
    uint64_t never_sent = 0, impossible = 0, twice = 0;
    for (uint32_t i = 0; i < 1'000; ++i) {
      const int64_t time_ns = kStart + i * kPeriod;
      const bool is_needed = i < 2 || i > 990;  // the first begins the count, the last ones end it
      const bool is_in_gap = i % 300 >= 200 && i % 300 < 230;  // 500 ms
      if (!is_needed && (is_in_gap || chance(10))) {
        ++never_sent;
        continue;
      }
      LivePose pose = numbered(i);
      // Some come a place late.
      const int64_t delay_ms = is_needed ? 0 : chance(15) ? 18 + random() % 8 : random() % 4;
      const int64_t arrival_ns = time_ns + delay_ms * kMsInNs;
      if (!is_needed && chance(4)) {
        ++impossible;
        ++never_sent;  // to the order it never came
        if (chance(50))
          pose.world_from_subject.rotation = glm::dquat(0.0, 0.0, 0.0, 0.0);
        else
          pose.world_from_subject.position_m.y = kNothing;
      } else if (!is_needed && chance(5)) {
        ++twice;
        sent.push_back({arrival_ns + 4 * kMsInNs, pose});
      }
      sent.push_back({arrival_ns, pose});
    }
    std::stable_sort(sent.begin(), sent.end(),
                     [](const Sent& a, const Sent& b) { return a.arrival_ns < b.arrival_ns; });
    Stage stage;
    for (const Sent& one : sent) stage.send(one.pose, one.arrival_ns);
    stage.until(sent.back().arrival_ns + 30 * kMsInNs);
    stage.expect_always_somewhere();
    stage.expect_no_faster_than_a_head();
    const LivePolicyCounters& counters = stage.policy.counters();
    EXPECT_EQ(counters.impossible, impossible);
    EXPECT_EQ(counters.late, twice) << "nothing came later than it is waited for";
    EXPECT_EQ(counters.lost, never_sent);
    EXPECT_GT(counters.resequenced, 20u);
    EXPECT_LT(glm::distance(stage.last().position_m, walking(kStart + 999 * kPeriod).position_m), 1e-9);
  }
}

/// Numbered, without a time, a millimetre further each.
LivePose framed(uint32_t frame) {
  LivePose live = live_pose({{1e-3 * frame, 0.0, 0.0}, {1, 0, 0, 0}});
  live.frame = frame;
  return live;
}

TEST(LivePolicy, OrderIsThatOfTheNumbersAsFarAsIsWaited) {
  Stage stage;
  int64_t time_ns = kStart;
  for (uint32_t i : {0u, 1u, 3u, 2u, 4u}) stage.send(framed(i), time_ns += 10 * kMsInNs);
  ASSERT_EQ(stage.heads.size(), 5u);
  for (uint32_t i = 0; i < 5; ++i)
    EXPECT_NEAR(stage.heads[i].world_from_head.position_m.x, 1e-3 * i, 1e-9) << i;
  expect_counts(stage.policy.counters(), {.resequenced = 1});

  // One that never comes is waited for 20 ms.
  stage.send(framed(6), time_ns += 10 * kMsInNs);
  stage.until(time_ns + 19 * kMsInNs);
  EXPECT_EQ(stage.heads.size(), 5u);
  stage.until(time_ns + 20 * kMsInNs);
  ASSERT_EQ(stage.heads.size(), 6u);
  EXPECT_NEAR(stage.last().position_m.x, 6e-3, 1e-9);
  stage.send(framed(5), time_ns + 21 * kMsInNs);
  EXPECT_EQ(stage.heads.size(), 6u);
  expect_counts(stage.policy.counters(), {.resequenced = 1, .late = 1, .lost = 1});
}

TEST(LivePolicy, NoMoreThanThreeWait) {
  Stage stage;
  stage.send(framed(0), kStart);
  for (uint32_t i : {2u, 3u, 4u}) stage.send(framed(i), kStart + i * kMsInNs);
  EXPECT_EQ(stage.heads.size(), 1u);
  stage.send(framed(5), kStart + 5 * kMsInNs);
  EXPECT_EQ(stage.heads.size(), 5u);
  expect_counts(stage.policy.counters(), {.lost = 1});
}

TEST(LivePolicy, ACountThatBeginsAgainIsFollowed) {
  Stage stage;
  for (uint32_t i = 0; i < 50; ++i) stage.send(numbered(5'000 + i), kStart + i * kPeriod);
  // The sender was started again.
  for (uint32_t i = 0; i < 50; ++i) {
    LivePose pose = numbered(5'050 + i);
    pose.frame = i;
    pose.source_time_ns = i * kPeriod;
    stage.send(pose, kStart + (50 + i) * kPeriod);
  }
  EXPECT_EQ(stage.heads.size(), 100u);
  // One that goes back a little is heard after a few.
  for (uint32_t i = 0; i < 20; ++i) {
    LivePose pose = numbered(5'100 + i);
    pose.frame = 10 + i;
    pose.source_time_ns = (10 + i) * kPeriod;
    stage.send(pose, kStart + (100 + i) * kPeriod);
  }
  EXPECT_EQ(stage.heads.size(), 120u - (kRestartPoses - 1));
  EXPECT_EQ(stage.policy.counters().late, kRestartPoses - 1);
}

TEST(LivePolicy, NumbersThatGoUpByMoreThanOneAreNoLoss) {
  Stage stage;
  for (uint32_t i = 0; i < 200; ++i) {
    LivePose pose = numbered(i);
    pose.frame = 4 * i;
    stage.send(pose, kStart + i * kPeriod);
  }
  const uint64_t at_first = stage.policy.counters().lost;
  EXPECT_GT(at_first, 0u) << "until it is a habit";
  for (uint32_t i = 200; i < 400; ++i) {
    LivePose pose = numbered(i);
    pose.frame = 4 * i;
    stage.send(pose, kStart + i * kPeriod);
  }
  EXPECT_EQ(stage.policy.counters().lost, at_first);
  EXPECT_LT(glm::distance(stage.last().position_m, walking(kStart + 399 * kPeriod).position_m), 1e-9);
}

TEST(LivePolicy, ASteadySourceWithTimesAloneIsPutInOrderToo) {
  Stage stage;
  const auto timed = [](uint32_t i) {
    LivePose pose = numbered(i);
    pose.frame.reset();
    return pose;
  };
  for (uint32_t i = 0; i < 40; ++i) stage.send(timed(i), kStart + i * kPeriod);
  stage.send(timed(41), kStart + 40 * kPeriod + kMsInNs);
  EXPECT_EQ(stage.heads.size(), 40u);
  stage.send(timed(40), kStart + 40 * kPeriod + 2 * kMsInNs);
  EXPECT_EQ(stage.heads.size(), 42u);
  stage.send(timed(40), kStart + 40 * kPeriod + 3 * kMsInNs);
  EXPECT_EQ(stage.policy.counters().resequenced, 1u);
  EXPECT_EQ(stage.policy.counters().late, 1u);
}

TEST(LivePolicy, ABodyThatIsElsewhereForAMomentWasAnotherOne) {
  Stage stage;
  const Pose here{{0.0, 1.6, 0.0}, {1, 0, 0, 0}};
  const Pose there{{0.0, 1.6, 0.76}, {1, 0, 0, 0}};
  for (int i = 0; i < 10; ++i) stage.send(live_pose(here), kStart + i * 10 * kMsInNs);
  for (int i = 10; i < 14; ++i) stage.send(live_pose(there), kStart + i * 10 * kMsInNs);
  for (int i = 14; i < 20; ++i) stage.send(live_pose(i % 2 ? here : there), kStart + i * 10 * kMsInNs);
  for (const LiveHead& head : stage.heads)
    EXPECT_LT(glm::distance(head.world_from_head.position_m, here.position_m), 1e-12);
  EXPECT_EQ(stage.policy.counters().gated, 7u);
}

TEST(LivePolicy, ABodyThatStaysElsewhereHasJumped) {
  Stage stage;
  const Pose here{{0.0, 1.6, 0.0}, {1, 0, 0, 0}};
  const Pose there{{0.0, 1.6, 3.0}, {1, 0, 0, 0}};
  for (int i = 0; i < 10; ++i) stage.send(live_pose(here), kStart + i * 10 * kMsInNs);
  int64_t believed_ns = 0;
  for (int i = 10; i < 40; ++i) {
    stage.send(live_pose(there), kStart + i * 10 * kMsInNs);
    if (believed_ns == 0 && stage.last().position_m.z > 0.1) believed_ns = kStart + i * 10 * kMsInNs;
  }
  EXPECT_EQ(believed_ns, kStart + 100 * kMsInNs + kGateNs);
  EXPECT_EQ(stage.policy.counters().gated, 10u);
  // The hub takes it for a jump, which strands are carried through, not for a head at 300 m/s.
  InputHub hub;
  bool has_teleported = false;
  size_t next = 0;
  for (int64_t time_ns = kStart; time_ns < kStart + 400 * kMsInNs; time_ns += 16 * kMsInNs) {
    for (; next < stage.heads.size() && stage.heads[next].time_ns <= time_ns; ++next)
      hub.push(1, MotionSamples{{{stage.heads[next].time_ns, stage.heads[next].world_from_head}}}, time_ns);
    const InputFrame frame = hub.sample(time_ns);
    const bool is_there = frame.world_from_head.position_m.z > 1.5;
    if (is_there && !has_teleported) {
      EXPECT_TRUE(frame.has_teleported);
    }
    has_teleported = has_teleported || is_there;
    EXPECT_TRUE(is_there || frame.world_from_head.position_m.z < 1e-9) << "between the two";
  }
  EXPECT_TRUE(has_teleported);
}

TEST(LivePolicy, AStepIsTakenAtTheSpeedOfAHead) {
  Stage stage;
  const Pose turned{{0.7, 0.0, 0.0}, glm::angleAxis(0.55, glm::dvec3(0, 1, 0))};
  for (int i = 0; i < 10; ++i) stage.send(live_pose({}), kStart + i * 10 * kMsInNs);
  for (int i = 10; i < 40; ++i) stage.send(live_pose(turned), kStart + i * 10 * kMsInNs);
  stage.expect_no_faster_than_a_head();
  EXPECT_LT(glm::distance(stage.last().position_m, turned.position_m), 1e-12);
  EXPECT_LT(angle_between_rad(stage.last().rotation, turned.rotation), 1e-6);
  const LivePolicyCounters& counters = stage.policy.counters();
  EXPECT_GE(counters.clamped, 4u);
  EXPECT_LE(counters.clamped, 10u);
}

TEST(LivePolicy, BurstsOfAHeadThatMovesAsHeadsDoAreNotClamped) {
  Stage stage;
  for (uint32_t i = 0; i < 300; ++i) {
    LivePose pose = numbered(i);
    pose.frame.reset();
    pose.source_time_ns.reset();
    // Every second one comes late, right before the next.
    stage.send(pose, kStart + i * kPeriod + (i % 2 ? 16 * kMsInNs : 0));
  }
  EXPECT_EQ(stage.policy.counters().clamped, 0u);
}

// Where it is meanwhile is the hub's to say.
TEST(LivePolicy, ALostHeadSaysNothingAndIsStaleAfterASecond) {
  Stage stage;
  for (int i = 0; i <= 100; ++i)
    stage.send(live_pose({{0.005 * i, 0.0, 0.0}, {1, 0, 0, 0}}), kStart + i * 10 * kMsInNs);
  const int64_t lost_ns = kStart + 1'000 * kMsInNs;
  const size_t before = stage.heads.size();
  stage.until(lost_ns + kMotionStaleNs);
  EXPECT_FALSE(stage.policy.is_stale(stage.now_ns));
  stage.until(lost_ns + kMotionStaleNs + 5 * kMsInNs);
  EXPECT_TRUE(stage.policy.is_stale(stage.now_ns));
  EXPECT_EQ(stage.heads.size(), before);
  // It comes back near by, where a head gets in that time.
  const glm::dvec3 back_m = stage.last().position_m + glm::dvec3(0.3, 0.0, 0.0);
  stage.send(live_pose({back_m, {1, 0, 0, 0}}), stage.now_ns);
  EXPECT_FALSE(stage.policy.is_stale(stage.now_ns));
  EXPECT_EQ(stage.last().position_m, back_m);
  EXPECT_EQ(stage.policy.counters().clamped, 0u);
  stage.expect_no_faster_than_a_head();
}

TEST(LivePolicy, AfterAGapTheHeadComesAfter) {
  Stage stage;
  for (uint32_t i = 0; i < 60; ++i) stage.send(live_pose({}), kStart + i * kPeriod);
  const int64_t back_ns = kStart + 60 * kPeriod + 500 * kMsInNs;
  const Pose moved{{0.6, 0.0, 0.0}, glm::angleAxis(1.0, glm::dvec3(0, 1, 0))};
  for (uint32_t i = 0; i < 30; ++i) stage.send(live_pose(moved), back_ns + i * kPeriod);
  stage.expect_no_faster_than_a_head();
  EXPECT_LT(glm::distance(stage.last().position_m, moved.position_m), 1e-12);
}

TEST(LivePolicy, WhatComesAfterASilenceIsBelievedWhereverItIs) {
  Stage stage;
  for (int i = 0; i < 10; ++i) stage.send(live_pose({}), kStart + i * 10 * kMsInNs);
  stage.send(live_pose({{5.0, 0.0, 0.0}, {1, 0, 0, 0}}), kStart + 2'000 * kMsInNs);
  EXPECT_DOUBLE_EQ(stage.last().position_m.x, 5.0);
  EXPECT_EQ(stage.policy.counters().gated, 0u);
  EXPECT_EQ(stage.policy.counters().clamped, 0u);
}

TEST(LivePolicy, AnotherSubjectIsBelievedAtOnce) {
  Stage stage;
  for (int i = 0; i < 10; ++i) stage.send(live_pose({}), kStart + i * 10 * kMsInNs);
  stage.policy.begin_another();
  stage.send(live_pose({{2.0, 0.0, 0.0}, {1, 0, 0, 0}}), kStart + 100 * kMsInNs);
  EXPECT_DOUBLE_EQ(stage.last().position_m.x, 2.0);
}

TEST(LivePolicy, BothSignsOfAQuaternionAreOneRotation) {
  Stage stage;
  for (uint32_t i = 0; i < 100; ++i) {
    LivePose pose = numbered(i);
    if (i % 2 == 1) pose.world_from_subject.rotation = -pose.world_from_subject.rotation;
    if (i % 3 == 1) pose.world_from_subject.rotation *= 1.7;  // of no unit length
    stage.send(pose, kStart + i * kPeriod);
  }
  stage.expect_always_somewhere();
  expect_counts(stage.policy.counters(), {});
}

TEST(LivePolicy, ImpossiblePosesAreCountedAndLeftOut) {
  Stage stage;
  const double kNan = std::numeric_limits<double>::quiet_NaN(),
               kInfinite = std::numeric_limits<double>::infinity();
  stage.send(live_pose({}), kStart);
  uint64_t sent = 0;
  for (const Pose& pose : {Pose{{kNan, 0, 0}, {1, 0, 0, 0}}, Pose{{0, kInfinite, 0}, {1, 0, 0, 0}},
                           Pose{{0, 0, 0}, {kNan, 0, 0, 0}}, Pose{{0, 0, 0}, {0, 0, 0, 0}},
                           Pose{{0, 0, 0}, {0.49, 0, 0, 0}}, Pose{{0, 0, 0}, {2.01, 0, 0, 0}},
                           Pose{{2e4, 0, 0}, {1, 0, 0, 0}}, Pose{{1e308, 1e308, 1e308}, {1, 0, 0, 0}}})
    stage.send(live_pose(pose), kStart + static_cast<int64_t>(++sent) * kMsInNs);
  EXPECT_EQ(stage.policy.counters().impossible, sent);
  EXPECT_EQ(stage.heads.size(), 1u);
}

TEST(LivePolicy, WhatIsSeenWhenCalibratedIsRest) {
  Stage stage;
  EXPECT_FALSE(stage.policy.calibrate(kStart)) << "nothing is seen";
  // The performer faces +X of the stage, the tracker leans forward on the head.
  const glm::dquat heading = glm::angleAxis(std::numbers::pi / 2, glm::dvec3(0, 1, 0));
  const glm::dquat mount = glm::angleAxis(0.4, glm::normalize(glm::dvec3(1, 0, 0.3)));
  const auto seen = [&](const Pose& head) {
    return live_pose(
        {glm::dvec3(3.0, 1.7, -2.0) + heading * head.position_m, heading * head.rotation * mount});
  };
  int64_t time_ns = kStart;
  const auto show = [&](const Pose& head) {
    for (int i = 0; i < 60; ++i) stage.send(seen(head), time_ns += 10 * kMsInNs);
  };
  show({});
  ASSERT_TRUE(stage.policy.calibrate(time_ns));
  EXPECT_TRUE(stage.policy.is_calibrated());
  show({});
  EXPECT_LT(glm::length(stage.last().position_m), 1e-9);
  EXPECT_LT(angle_between_rad(stage.last().rotation, {1, 0, 0, 0}), 1e-6);
  // A heading is about +Y, which a leaning tracker's own axes are not: what is left of the lean is small.
  for (const glm::dvec3& axis : {glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0), glm::dvec3(0, 0, 1)}) {
    const Pose head{{0.1, -0.05, 0.2}, glm::angleAxis(0.5, axis)};
    show(head);
    EXPECT_LT(glm::distance(stage.last().position_m, head.position_m), 0.03);
    EXPECT_LT(angle_between_rad(stage.last().rotation, head.rotation), 0.09);
  }
  stage.policy.reset_calibration();
  show({});
  EXPECT_LT(glm::distance(stage.last().position_m, {3.0, 1.7, -2.0}), 1e-9);
}

TEST(LivePolicy, CalibrationTakesOutHeadingAndTiltExactly) {
  // Of a mount that only tilts, in any direction that has no turn about +Y of its own, and any heading.
  for (const double heading_rad : {0.0, 1.1, -2.9})
    for (const glm::dvec3& tilt_axis : {glm::dvec3(1, 0, 0), glm::dvec3(0, 0, 1)}) {
      Stage stage;
      const glm::dquat heading = glm::angleAxis(heading_rad, glm::dvec3(0, 1, 0));
      const glm::dquat mount = glm::angleAxis(-0.6, tilt_axis);
      int64_t time_ns = kStart;
      const auto show = [&](const Pose& head) {
        for (int i = 0; i < 60; ++i)
          stage.send(live_pose({heading * head.position_m, heading * head.rotation * mount}),
                     time_ns += 10 * kMsInNs);
      };
      show({});
      ASSERT_TRUE(stage.policy.calibrate(time_ns));
      const Pose head{{0.1, 0.2, -0.1}, glm::angleAxis(0.7, glm::normalize(glm::dvec3(1, 2, -0.5)))};
      show(head);
      EXPECT_LT(glm::distance(stage.last().position_m, head.position_m), 1e-9);
      EXPECT_LT(angle_between_rad(stage.last().rotation, head.rotation), 1e-6);
    }
}

TEST(LivePolicy, JointsAreToldFromTheHead) {
  Stage stage;
  LivePose pose = live_pose({{1.0, 1.5, 2.0}, glm::angleAxis(std::numbers::pi / 2, glm::dvec3(0, 1, 0))});
  pose.joint_names = {"neck", "neck", "", "far", std::string(33, 'x'), "left_shoulder"};
  pose.joint_m = {{1.0, 1.4, 2.0}, {0, 0, 0}, {0, 0, 0}, {99, 0, 0}, {1, 1, 1}, {1.0, 1.3, 1.8}};
  stage.send(pose, kStart);
  ASSERT_EQ(stage.heads.size(), 1u);
  const LiveHead& head = stage.heads[0];
  EXPECT_EQ(head.joint_names, (std::vector<std::string>{"neck", "left_shoulder"}));
  ASSERT_EQ(head.joint_m.size(), 2u);
  EXPECT_LT(glm::distance(glm::dvec3(head.joint_m[0]), glm::dvec3(0, -0.1, 0)), 1e-6);
  // -Z of the world is +X of a head that faces +X.
  EXPECT_LT(glm::distance(glm::dvec3(head.joint_m[1]), glm::dvec3(0.2, -0.2, 0)), 1e-6);
}

TEST(LivePolicy, AHeadThatOnlyTurnsStaysWhereItIs) {
  Stage turns(true), told;
  for (int i = 0; i < 50; ++i) {
    LivePose pose = live_pose(walking(kStart + i * 10 * kMsInNs));
    turns.send(pose, kStart + i * 10 * kMsInNs);
    pose.has_position = false;
    told.send(pose, kStart + i * 10 * kMsInNs);
  }
  for (const Stage* stage : {&turns, &told}) {
    ASSERT_EQ(stage->heads.size(), 50u);
    for (const LiveHead& head : stage->heads) EXPECT_EQ(head.world_from_head.position_m, glm::dvec3(0.0));
    EXPECT_LT(angle_between_rad(stage->last().rotation, walking(kStart + 490 * kMsInNs).rotation), 1e-6);
  }
}

}  // namespace
}  // namespace strandcast::live_policy_test
