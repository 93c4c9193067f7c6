// What strandcast-ctl bake makes of its options: how the motion sets in, which states are asked for, and the
// server's words. The program itself: tests/integration/bake_test.cpp.
#include <gmock/gmock.h>

#include "client/app/bake_command.h"
#include "client/app/baked_states.h"
#include "common/math/turn.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::bake_test {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::Not;

constexpr double kLeadS = 0.8, kSlope = 1e-4;

/// Somebody who is on the way from the first moment on.
FeedPlan walk() {
  FeedPlan plan;
  plan.motion = [](double t_s) {
    t_s = std::max(t_s, 0.0);
    return Pose{{1.2 * t_s, 1.6, 0.1 * std::sin(5.0 * t_s)},
                glm::angleAxis(0.3 + 2.0 * t_s, glm::dvec3(0, 1, 0))};
  };
  plan.joints = [](double t_s) { return std::vector<glm::dvec3>{{t_s, 0, 0}}; };
  return plan;
}
glm::dvec3 mps_of(const FeedPlan& plan, double t_s) {
  return (plan.motion(t_s + kSlope).position_m - plan.motion(t_s).position_m) / kSlope;
}
glm::dvec3 rad_per_s_of(const FeedPlan& plan, double t_s) {
  return turn_between(plan.motion(t_s).rotation, plan.motion(t_s + kSlope).rotation) / kSlope;
}

TEST(BakeLead, TheHeadComesFromRestAndArrivesWithTheSpeedOfTheStart) {
  const FeedPlan plain = walk(), led = with_lead(plain, kLeadS);
  EXPECT_LT(glm::length(mps_of(led, 0.0)), 1e-2);
  EXPECT_LT(glm::length(rad_per_s_of(led, 0.0)), 1e-2);
  for (const double t_s : {kLeadS - 2.0 * kSlope, kLeadS + kSlope}) {
    EXPECT_LT(glm::distance(mps_of(led, t_s), mps_of(plain, 0.0)), 5e-3) << t_s;
    EXPECT_LT(glm::distance(rad_per_s_of(led, t_s), rad_per_s_of(plain, 0.0)), 5e-3) << t_s;
  }
  // From there on it is the motion at its own times.
  for (const double t_s : {0.0, 0.31, 1.7}) {
    EXPECT_NEAR(glm::distance(led.motion(t_s + kLeadS).position_m, plain.motion(t_s).position_m), 0.0, 1e-12);
    EXPECT_NEAR(led.joints(t_s + kLeadS)[0].x, t_s, 1e-12);
  }
  EXPECT_EQ(led.joints(0.1)[0].x, 0.0) << "the body waits";
  // Without a lead the head is at its speed at once.
  EXPECT_GT(glm::length(mps_of(with_lead(plain, 0.0), 0.0)), 1.0);
}

TEST(BakePaths, NumberedFilesAreNotWrittenOverTheHairThatIsRead) {
  const TemporaryFolder folder;
  const auto said_of = [&](const char* hair, const char* out) {
    BakeCommand command;
    command.exported.paths = {folder.write(hair, "no hair").string(), (folder.path() / out).string()};
    command.server = folder.path() / "none";
    command.feed.motion = "builtin";
    command.exported.seconds = 1.0;
    testing::internal::CaptureStderr();
    EXPECT_EQ(run_bake(command, false), kBadInputExit);
    return testing::internal::GetCapturedStderr();
  };
  const auto is_caught = testing::HasSubstr("is read, and would be written over");
  EXPECT_THAT(said_of("hair_0001.ply", "hair.ply"), is_caught);
  EXPECT_THAT(said_of("hair_12345.ply", "hair.ply"), is_caught);
  EXPECT_THAT(said_of("hair_a1.ply", "hair.ply"), Not(is_caught));
  EXPECT_THAT(said_of("hair_0001.ply", "hair.abc"), Not(is_caught));
  EXPECT_THAT(said_of("other_0001.ply", "hair.ply"), Not(is_caught));
}

TEST(BakeSteps, AStateIsAskedForWhereAFrameIs) {
  EXPECT_EQ(steps_between(60.0, 30.0), 2u);
  EXPECT_EQ(steps_between(120.0, 24.0), 5u);
  EXPECT_EQ(steps_between(60.0, 60.0), 1u);
  EXPECT_EQ(steps_between(24000.0 / 1001.0 * 4.0, 24000.0 / 1001.0), 4u);
  // Between states a frame is made of all of them.
  EXPECT_EQ(steps_between(60.0, 24.0), 1u);
  EXPECT_EQ(steps_between(60.0, 120.0), 1u);
}

TEST(BakeServer, GetsTheHairAndWhatThePersonSaysLast) {
  BakeCommand command;
  command.exported.paths = {"a.ply", "b.ply", "out.abc"};
  command.overrides = {"stream.bound_m=1e-4"};
  const std::vector<std::string> words = server_words(command);
  EXPECT_THAT(words, AllOf(Contains("--lockstep"), Contains("a.ply"), Contains("b.ply"),
                           Contains("quality=full"), Not(Contains("out.abc"))));
  EXPECT_EQ(words.back(), "stream.bound_m=1e-4");
  BakeCommand scene;
  scene.exported.paths = {"out.abc"};
  scene.scene = "s.textproto";
  EXPECT_THAT(server_words(scene),
              AllOf(Contains("s.textproto"), Not(Contains("--groom")), Not(Contains("quality=full"))));
}

// A forgotten name costs nobody a file. The counter-example is a name that nothing has.
TEST(BakePaths, WhatIsReadAndWhatIsThereIsNotWrittenOver) {
  const TemporaryFolder folder;
  const std::string hair = folder.write("hair.ply", "hair").string(), same = hair.substr(0, hair.size() - 8);
  bool is_replacing = false;
  const auto said = [&](std::vector<std::string> paths, const std::string& motion = "none") {
    BakeCommand command;
    command.is_replacing = is_replacing;
    command.exported.paths = std::move(paths);
    command.feed.motion = motion;
    command.feed.wind = "none";
    testing::internal::CaptureStderr();
    EXPECT_EQ(run_bake(command, false), kBadInputExit);
    return testing::internal::GetCapturedStderr();
  };
  EXPECT_THAT(said({hair}), testing::HasSubstr("hair.ply is there already"));
  EXPECT_THAT(said({hair, same + "./hair.ply"}), testing::HasSubstr("hair.ply is read, and would"));
  EXPECT_THAT(said({"new.ply", hair}, hair), testing::HasSubstr("hair.ply is read, and would"));
  const std::string other = folder.write("other.usda", "other hair").string();
  EXPECT_THAT(said({hair, other}), testing::HasSubstr("other.usda is there already: --replace"));
  EXPECT_THAT(said({"walk.bvh", "out.abc"}), testing::HasSubstr("--motion walk.bvh"));
  EXPECT_THAT(said({(folder.path() / "new.abc").string()}), testing::HasSubstr("this motion has no end"));
  // Who asks for it gets it, but for what is read.
  is_replacing = true;
  for (const auto& paths : {std::vector{other}, std::vector{hair, other}})
    EXPECT_THAT(said(paths), testing::HasSubstr("this motion has no end"));
  EXPECT_THAT(said({hair, hair}), testing::HasSubstr("hair.ply is read, and would"));
}

}  // namespace
}  // namespace strandcast::bake_test
