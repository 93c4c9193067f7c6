// Laws of DrawPlan: what it chooses for machines of any speed, and that it keeps to it.
#include "client/app/draw_plan.h"
#include "common/base/units.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace strandcast::draw_plan_test {
namespace {
constexpr int64_t kDisplayNs = kSInNs / 60;
constexpr size_t kLast = kDrawSteps.size() - 1;
// As docs/internals/rendering.md says: ten pictures a second, half a pixel, 200 ms.
static_assert(kMovingBudgetMs == 100.0 && kSeenPx == 0.5 && kStandNs == 200 * kMsInNs);

/// A machine on which a picture of the first step takes so long, and the others as the table says.
double time_of(size_t step, double full_ms) {
  return full_ms * kDrawSteps[step].cost;
}

/// Draws for so long while the camera moves all the time; how often the step changed.
template <class Time>
int draw_moving(DrawPlan& plan, int64_t& time_ns, int64_t for_ns, const Time& time_ms) {
  int changes = 0;
  for (const int64_t end_ns = time_ns + for_ns; time_ns < end_ns;) {
    plan.note_motion(time_ns);
    const size_t step = plan.step_at(time_ns, plan.moving_step());
    const double ms = time_ms(step);
    time_ns += std::max(static_cast<int64_t>(ms * 1e6), kDisplayNs);
    plan.note_drawn(step, ms, time_ns);
    changes += plan.moving_step() != step ? 1 : 0;
  }
  return changes;
}

TEST(DrawSteps, GetCheaperAndCoarser) {
  for (size_t step = 1; step <= kLast; ++step) {
    EXPECT_LT(kDrawSteps[step].cost, kDrawSteps[step - 1].cost);
    EXPECT_LE(kDrawSteps[step].size_share, kDrawSteps[step - 1].size_share);
    EXPECT_LE(kDrawSteps[step].strand_share, kDrawSteps[step - 1].strand_share);
  }
  EXPECT_EQ(kDrawSteps[0].size_share, 1.0);
  EXPECT_EQ(kDrawSteps[0].strand_share, 1.0);
  EXPECT_EQ(kDrawSteps[kCoarsestFairStep].size_share, 0.5);
  EXPECT_EQ(kDrawSteps[kCoarsestFairStep].strand_share, 1.0);
}

TEST(SeenMotion, IsTheFarthestWayOfAVertexInPixels) {
  CameraDesc camera;
  camera.offset_m = {0.0f, 0.0f, 2.0f};
  camera.fov_y_rad = 2.0f * std::atan(0.5f);  // 1 m high at 1 m: 2 m at the head
  const RenderSize size{800, 500};            // 250 px per metre
  PosedStrands from;
  from.position_m = {{0.1f, 0.0f, 0.0f}, {0.0f, 0.3f, 0.0f}, {0.0f, 0.0f, 0.2f}};
  PosedStrands to = from;
  EXPECT_EQ(seen_motion_px(from, to, camera, size), 0.0);
  to.position_m[2].y += 0.004f;
  EXPECT_NEAR(seen_motion_px(from, to, camera, size), 1.0, 1e-4);
  // A turn by 0.1 rad about the vertical carries what is 0.2 m from the axis along the chord; a walk of the
  // head carries nothing anywhere, for the camera goes along.
  to = from;
  to.world_from_head.rotation = glm::angleAxis(0.1, glm::dvec3(0.0, 1.0, 0.0));
  to.world_from_head.position_m = {5.0, 0.0, 0.0};
  EXPECT_NEAR(seen_motion_px(from, to, camera, size), 2.0 * 0.2 * std::sin(0.05) * 250.0, 1e-3);
  to.position_m.pop_back();
  EXPECT_GT(seen_motion_px(from, to, camera, size), 1e9) << "another groom";
}

TEST(SizeOfStep, KeepsTheWindowsShapeAndIsNeverNothing) {
  EXPECT_EQ(size_of_step(0, {1280, 720}).width, 1280u);
  EXPECT_EQ(size_of_step(kCoarsestFairStep, {1280, 720}).width, 640u);
  EXPECT_EQ(size_of_step(kCoarsestFairStep, {1280, 720}).height, 360u);
  EXPECT_EQ(size_of_step(0, {1280, 720}).height, 720u);
  EXPECT_EQ(size_of_step(kLast, {1, 2}).width, 1u);
}

TEST(DrawPlan, FindsTheFinestStepThatIsInTimeOnEveryMachine) {
  for (double full_ms = 1.0; full_ms < 30'000.0; full_ms *= 1.6)
    for (const size_t first : {size_t{0}, size_t{3}, kLast}) {
      DrawPlan plan(first);
      int64_t time_ns = kSInNs;
      const auto time_ms = [&](size_t step) { return time_of(step, full_ms); };
      draw_moving(plan, time_ns, 10 * kSInNs, time_ms);
      const size_t found = plan.moving_step();
      EXPECT_TRUE(found == kLast || time_ms(found) <= kTooLong * kMovingBudgetMs) << full_ms;
      EXPECT_TRUE(found == 0 || time_ms(found - 1) > kLeavesRoom * kMovingBudgetMs) << full_ms;
      EXPECT_EQ(draw_moving(plan, time_ns, kForgetStepNs + kSInNs, time_ms), 0) << "and stays there";
    }
}

TEST(DrawPlan, StaysThoughTimesVaryAndTheTableIsWrong) {
  for (double full_ms = 1.0; full_ms < 30'000.0; full_ms *= 1.6)
    for (const double exponent : {0.3, 1.0, 2.0}) {
      DrawPlan plan(3);
      int64_t time_ns = kSInNs;
      uint32_t turn = 0;
      const auto time_ms = [&](size_t step) {
        const double noise = 1.0 + 0.1 * std::sin(2.4 * ++turn);
        return noise * full_ms * std::pow(kDrawSteps[step].cost, exponent);
      };
      draw_moving(plan, time_ns, 10 * kSInNs, time_ms);
      // A step that is worth another try, and back.
      EXPECT_LE(draw_moving(plan, time_ns, kForgetStepNs, time_ms), 2) << full_ms << " " << exponent;
    }
}

TEST(DrawPlan, AMachineThatBecomesBusyOrFreeIsFollowed) {
  DrawPlan plan(3);
  int64_t time_ns = kSInNs;
  const auto machine = [](double full_ms) { return [=](size_t step) { return time_of(step, full_ms); }; };
  draw_moving(plan, time_ns, 10 * kSInNs, machine(50.0));
  EXPECT_EQ(plan.moving_step(), 0u);
  draw_moving(plan, time_ns, 2 * kSInNs, machine(400.0));
  EXPECT_EQ(plan.moving_step(), 3u) << "a step of 72 ms; the one before takes 140";
  draw_moving(plan, time_ns, 2 * kForgetStepNs, machine(50.0));
  EXPECT_EQ(plan.moving_step(), 0u);
}

TEST(DrawPlan, WhatStandsIsDrawnWholeAndWhatMovesInTime) {
  DrawPlan plan(3);
  int64_t time_ns = kSInNs;
  draw_moving(plan, time_ns, 10 * kSInNs, [](size_t step) { return time_of(step, 1000.0); });
  const size_t moving = plan.moving_step();
  EXPECT_EQ(moving, 4u);
  plan.note_motion(time_ns);
  EXPECT_EQ(plan.standing_from_ns(), time_ns + kStandNs);
  EXPECT_EQ(plan.step_at(time_ns + kStandNs - 1, moving), moving);
  EXPECT_EQ(plan.step_at(time_ns + kStandNs, moving), kCoarsestFairStep) << "soon something better";
  EXPECT_EQ(plan.step_at(time_ns + kStandNs, kCoarsestFairStep), 0u);
  plan.note_drawn(0, 1000.0, time_ns + kSInNs);
  EXPECT_EQ(plan.moving_step(), moving) << "a sharp picture is no reason to draw others otherwise";
  plan.note_motion(time_ns + 2 * kSInNs);
  EXPECT_EQ(plan.step_at(time_ns + 2 * kSInNs, 0), moving);
}

TEST(DrawPlan, AnotherWindowIsExpectedToTakeAccordingly) {
  DrawPlan plan(2);
  plan.set_pixels(1'000'000);
  plan.note_drawn(2, 35.0, kSInNs);
  EXPECT_EQ(plan.moving_step(), 1u) << "all of it would take 100 ms, this one 65";
  plan.set_pixels(250'000);
  // A quarter of the pixels: 4^-0.75 of the time.
  EXPECT_NEAR(plan.expected_ms(2, kSInNs), 35.0 * std::pow(4.0, -0.75), 1e-9);
  plan.note_drawn(2, 12.4, 2 * kSInNs);
  EXPECT_EQ(plan.moving_step(), 0u);
}

TEST(DrawPlan, TellsTheServerOfPicturesThatAreWorthComparing) {
  for (double full_ms = 1.0; full_ms < 30'000.0; full_ms *= 1.6) {
    DrawPlan plan(3);
    EXPECT_EQ(plan.fair_ms(kSInNs), 0.0) << "nothing was measured";
    int64_t time_ns = kSInNs;
    const auto time_ms = [&](size_t step) { return time_of(step, full_ms); };
    draw_moving(plan, time_ns, 10 * kSInNs, time_ms);
    const double told_ms = plan.fair_ms(time_ns);
    // Never of a picture smaller than the server's smallest, and never of one finer than what is shown.
    EXPECT_GE(told_ms, time_of(kCoarsestFairStep, full_ms) - 1e-9);
    EXPECT_GE(told_ms, time_ms(plan.moving_step()) - 1e-9);
    EXPECT_LE(told_ms, full_ms + 1e-9);
    // Whether it stands or moves changes nothing: a server that hears this has no reason to change twice.
    plan.note_drawn(0, full_ms, time_ns);
    EXPECT_NEAR(plan.fair_ms(time_ns), told_ms, 1e-6 * told_ms);
  }
}

}  // namespace
}  // namespace strandcast::draw_plan_test
