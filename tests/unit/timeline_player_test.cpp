// What is played of states as they come: which way between them is taken, how late, and how near the truth.
#include <cmath>
#include <numbers>

#include "common/base/units.h"
#include "common/replay/strand_replay.h"

namespace strandcast::timeline_player_test {
namespace {
constexpr int64_t kTickNs = 16'666'667;
constexpr int64_t kSettled = 60;  // states until the clock has settled

constexpr double kRadiusM = 0.1;
constexpr double kTurnRadPerS = 3.0 * std::numbers::pi;

glm::vec3 on_circle(double t_s) {
  const double angle = kTurnRadPerS * t_s;
  return {kRadiusM * std::cos(angle), 0.2, kRadiusM * std::sin(angle)};
}
/// What is shown beside the truth of the moment that it shows.
double error_m(const PosedStrands& shown) {
  return glm::distance(shown.position_m[0], on_circle(shown.world_from_head.position_m.x));
}

/// A state of a vertex on the circle; the head is where the time is, so that pictures say their moment.
std::shared_ptr<const Snapshot> played_state(int64_t sim_time_ns) {
  auto snapshot = std::make_shared<Snapshot>();
  const double t_s = static_cast<double>(sim_time_ns) / kNsPerS;
  snapshot->sim_time_ns = sim_time_ns;
  snapshot->world_from_head.position_m.x = t_s;
  snapshot->strand_count = 1;
  snapshot->vertex_count = 1;
  snapshot->quantum_m = 1e-7f;
  const glm::vec3 at = on_circle(t_s);
  for (int axis = 0; axis < 3; ++axis)
    snapshot->lattice.push_back(static_cast<int32_t>(std::lround(at[axis] / 1e-7f)));
  return snapshot;
}

// A head that moves by one unit a step is shown moving by as much at every moment, across states too.
TEST(TimelinePlayer, EvenStatesAreShownInEqualIncrements) {
  SnapshotTimeline timeline;
  timeline.set_playout(Playout::Smooth);
  TimelinePlayer player;
  double last_head = 0.0, last_vertex = 0.0;
  int increments = 0;
  for (int64_t step = 0; step < 90; ++step) {
    auto snapshot = std::make_shared<Snapshot>();
    snapshot->sim_time_ns = step * kTickNs;
    snapshot->world_from_head.position_m.x = static_cast<double>(step);
    snapshot->strand_count = 1;
    snapshot->vertex_count = 2;
    snapshot->quantum_m = 1e-3f;
    snapshot->lattice.assign(6, static_cast<int32_t>(1'000 * step));
    timeline.add(snapshot, step * kTickNs, Continuity::SameStream);
    constexpr int64_t kParts = 8;
    for (int64_t part = 0; part < kParts; ++part) {
      const auto strands = player.strands_at(timeline, step * kTickNs + part * kTickNs / kParts);
      ASSERT_TRUE(strands);
      const double head = strands->world_from_head.position_m.x;
      const double vertex = strands->position_m[1].y;
      if (step >= 60) {  // the clock has settled
        EXPECT_NEAR(head - last_head, 1.0 / kParts, 1e-3) << "step " << step << ", part " << part;
        EXPECT_NEAR(vertex - last_vertex, 1.0 / kParts, 1e-3) << "step " << step << ", part " << part;
        ++increments;
      }
      last_head = head;
      last_vertex = vertex;
    }
  }
  EXPECT_EQ(increments, 240);
}

struct Played {
  int count[3] = {};       // by Interpolation
  double worst_m = 0.0;    // beside the truth of the moment that is shown
  double behind_s = 0.0;   // of the last picture, behind the newest state's time now
  double longest_s = 0.0;  // between two pictures
};

/// Plays states that come when their time is, every `ticks`th of 60 a second, in turn; looks at pictures from
/// `look_from_s` on.
Played play(const std::vector<int>& ticks, double seconds, double look_from_s) {
  SnapshotTimeline timeline;
  timeline.set_playout(Playout::Smooth);
  TimelinePlayer player;
  Played played;
  int64_t tick = 0;
  size_t next = 0;
  double last_s = -1.0;
  for (int64_t picture = 0; picture < std::llround(seconds * 60.0); ++picture) {
    const int64_t client_ns = picture * kTickNs + 3 * kMsInNs;
    for (; tick * kTickNs <= client_ns; tick += ticks[std::min(next++, ticks.size() - 1)])
      timeline.add(played_state(tick * kTickNs), tick * kTickNs, Continuity::SameStream);
    const auto strands = player.strands_at(timeline, client_ns);
    if (!strands) continue;
    const double shown_s = strands->world_from_head.position_m.x;
    if (static_cast<double>(client_ns) / kNsPerS >= look_from_s) {
      ++played.count[static_cast<size_t>(player.interpolation())];
      played.worst_m = std::max(played.worst_m, error_m(*strands));
      played.longest_s = std::max(played.longest_s, shown_s - last_s);
      EXPECT_GE(shown_s, last_s) << "never back";
    }
    played.behind_s = static_cast<double>(client_ns) / kNsPerS - shown_s;
    last_s = shown_s;
  }
  return played;
}

constexpr size_t kNone = static_cast<size_t>(Interpolation::None);
constexpr size_t kLinear = static_cast<size_t>(Interpolation::Linear);
constexpr size_t kCubic = static_cast<size_t>(Interpolation::Cubic);

TEST(TimelinePlayer, ThirtyStatesASecondGoOnCubicsOneFrameLater) {
  const Played slow = play({2}, 4.0, 2.0);
  EXPECT_EQ(slow.count[kCubic], 120);
  EXPECT_NEAR(slow.behind_s, 2.0 / 30.0, 1e-3);
  const double turn = kTurnRadPerS / 30.0;
  EXPECT_LT(slow.worst_m, 3.0 / 128.0 * kRadiusM * std::pow(turn, 4) + 3e-7);
  const Played fast = play({1}, 4.0, 2.0);
  EXPECT_EQ(fast.count[kLinear], 120) << "no more delay than before";
  EXPECT_NEAR(fast.behind_s, 1.0 / 60.0, 1e-3);
  EXPECT_LT(fast.worst_m, kRadiusM * std::pow(turn / 2.0, 2) / 8.0 + 3e-7);
  EXPECT_LT(slow.worst_m, fast.worst_m / 5.0);
  const Played slowest = play({6}, 6.0, 4.0);
  EXPECT_EQ(slowest.count[kCubic], 0);
  EXPECT_NEAR(slowest.behind_s, 0.1, 2e-3);
}

TEST(TimelinePlayer, HalfTheStatesFromNowOnAreFollowedWithoutAJump) {
  std::vector<int> ticks(120, 1);
  ticks.push_back(2);
  // From a third of a second after the change on all of it is on cubics, and time never stands.
  const Played halved = play(ticks, 4.0, 2.35);
  EXPECT_EQ(halved.count[kNone], 0);
  EXPECT_EQ(halved.count[kLinear], 0);
  EXPECT_NEAR(halved.behind_s, 2.0 / 30.0, 3e-3);
  const Played during = play(ticks, 2.35, 1.9);
  EXPECT_LT(during.longest_s, 2.0 / 60.0) << "half as fast again at most, while it catches up";
  std::vector<int> doubled(60, 2);
  doubled.push_back(1);
  const Played after = play(doubled, 6.0, 4.0);
  EXPECT_NEAR(after.behind_s, 1.0 / 60.0, 1e-3);
  EXPECT_EQ(after.count[kNone], 0);
}

TEST(TimelinePlayer, ALostFrameStaysOnCubics) {
  std::vector<int> ticks(90, 2);
  ticks.push_back(4);
  ticks.push_back(2);
  const Played lost = play(ticks, 4.5, 2.5);
  EXPECT_GT(lost.count[kCubic], 110);
  EXPECT_EQ(lost.count[kCubic] + lost.count[kLinear] + lost.count[kNone], 120);
}

TEST(TimelinePlayer, WhatWasChosenStaysUntilTheNextState) {
  SnapshotTimeline timeline;
  timeline.set_playout(Playout::Smooth);
  TimelinePlayer player;
  const auto add = [&](int64_t tick) {
    timeline.add(played_state(tick * kTickNs), tick * kTickNs, Continuity::SameStream);
  };
  for (int64_t tick = 0; tick <= 100; ++tick) add(tick);
  const auto at = [&](double ticks) {
    const auto strands = player.strands_at(timeline, static_cast<int64_t>(ticks * kTickNs));
    EXPECT_TRUE(strands);
    return player.interpolation();
  };
  EXPECT_EQ(at(100.3), Interpolation::Linear) << "between 99 and 100, and there is no 101";
  timeline.add(played_state(101 * kTickNs), 100 * kTickNs + 5 * kMsInNs, Continuity::SameStream);
  EXPECT_EQ(at(100.6), Interpolation::Linear) << "a change in the middle would be seen";
  timeline.add(played_state(102 * kTickNs), 101 * kTickNs + kMsInNs, Continuity::SameStream);
  EXPECT_EQ(at(101.5), Interpolation::Cubic) << "between 100 and 101, and 102 is early";
  timeline.set_playout(Playout::LowLatency);
  EXPECT_EQ(at(101.6), Interpolation::None);
}

TEST(TimelinePlayer, AResetServerStartsOnTheLine) {
  SnapshotTimeline timeline;
  timeline.set_playout(Playout::Smooth);
  TimelinePlayer player;
  const int64_t step_ns = 2 * kTickNs;
  int64_t client_ns = 0;
  const auto play_on = [&](int64_t begin, int64_t end) {
    Interpolation last = Interpolation::None;
    for (int64_t i = begin; i < end; ++i, client_ns += step_ns) {
      timeline.add(played_state(i * step_ns), client_ns, Continuity::SameStream);
      for (const int64_t part : {0, 1}) {
        const auto strands = player.strands_at(timeline, client_ns + part * step_ns / 2);
        EXPECT_TRUE(strands);
        const double shown_s = strands->world_from_head.position_m.x;
        EXPECT_LE(shown_s, static_cast<double>(i * step_ns) / kNsPerS + 1e-9);
        EXPECT_GE(shown_s, static_cast<double>((i - 4) * step_ns) / kNsPerS) << "nothing of the old run";
        EXPECT_LT(error_m(*strands), 2e-3);
      }
      last = player.interpolation();
      // The first state that has one before it lies between two frames later.
      EXPECT_TRUE(i >= 3 || last != Interpolation::Cubic) << i;
    }
    return last;
  };
  EXPECT_EQ(play_on(0, kSettled), Interpolation::Cubic);
  EXPECT_EQ(play_on(0, kSettled), Interpolation::Cubic) << "reset";
  client_ns += 2'000 * kMsInNs;
  EXPECT_EQ(play_on(kSettled, 2 * kSettled), Interpolation::Cubic) << "paused and resumed";
}

/// Of so many strands that all do the same.
std::shared_ptr<const Snapshot> state_of(uint32_t strand_count, int64_t sim_time_ns) {
  auto snapshot = std::make_shared<Snapshot>(*played_state(sim_time_ns));
  const std::vector<int32_t> one = snapshot->lattice;
  snapshot->strand_count = strand_count;
  snapshot->lattice.clear();
  for (const int32_t value : one) snapshot->lattice.insert(snapshot->lattice.end(), strand_count, value);
  return snapshot;
}

TEST(TimelinePlayer, AChangeToFewerStrandsThatNothingFillsGoesOnTheLineOrJumps) {
  SnapshotTimeline timeline;
  timeline.set_playout(Playout::Smooth);
  TimelinePlayer player;
  const int64_t step_ns = 2 * kTickNs;
  int cubic_after = 0;
  for (int64_t i = 0; i < 2 * kSettled; ++i) {
    timeline.add(state_of(i < kSettled ? 3 : 1, i * step_ns), i * step_ns, Continuity::SameStream);
    const auto strands = player.strands_at(timeline, i * step_ns + step_ns / 2);
    ASSERT_TRUE(strands);
    const size_t shown = strands->position_m.size();
    ASSERT_TRUE(shown == 3 || shown == 1) << i;
    // Two frames behind, the way from one number to the other is shown two to three frames after it came.
    EXPECT_EQ(shown, i < kSettled + 1 ? 3u : 1u) << i;
    const bool is_cubic = player.interpolation() == Interpolation::Cubic;
    EXPECT_TRUE(is_cubic || i <= 10 || (i >= kSettled && i < kSettled + 3)) << i;
    if (i >= kSettled && i < kSettled + 3) cubic_after += is_cubic ? 1 : 0;
    for (const glm::vec3& point : strands->position_m) EXPECT_EQ(point, strands->position_m[0]);
  }
  EXPECT_EQ(cubic_after, 0) << "states of different numbers are on no cubic";
}

TEST(TimelinePlayer, OfHugeStatesTheLineIsShown) {
  SnapshotTimeline timeline(3 * 3 * sizeof(int32_t) - 1);  // of a state of 12 bytes two are kept
  timeline.set_playout(Playout::Smooth);
  TimelinePlayer player;
  for (int64_t i = 0; i < kSettled; ++i) {
    timeline.add(played_state(2 * i * kTickNs), 2 * i * kTickNs, Continuity::SameStream);
    ASSERT_TRUE(player.strands_at(timeline, 2 * i * kTickNs + kMsInNs));
    EXPECT_TRUE(i < 10 || player.interpolation() == Interpolation::Linear) << i;
  }
}

}  // namespace
}  // namespace strandcast::timeline_player_test
