// What a source of files makes of a simulation that is slower than real time: slow motion, unless it is live.
#include "client/app/feed.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <optional>
#include <thread>
#include <vector>

#include "tests/support/client_config.h"
#include "tests/support/fake_server.h"

namespace strandcast::feed_test {
namespace {

using test::config_for;
using test::FakePeer;
using test::FakeServer;

constexpr size_t kSamples = 60;

ServerStatus status_of(double realtime_factor, bool is_paused = false) {
  ServerStatus status;
  status.realtime_factor = realtime_factor;
  status.is_paused = is_paused;
  return status;
}

/// A head that is t metres along x at time t.
FeedPlan plan_of(bool is_live) {
  FeedPlan plan;
  plan.motion = [](double t_s) { return Pose{{t_s, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}}; };
  plan.rate_hz = 200.0;
  plan.is_live = is_live;
  return plan;
}

struct Fed {
  std::vector<MotionSamples> heard;
  FeedProgress progress;
};

std::unique_ptr<SteadyClient> joined(const ClientConfig& config) {
  auto client = std::make_unique<SteadyClient>(config);
  const std::atomic<bool> never{false};
  const Status status = client->await_welcome(never);
  EXPECT_TRUE(status) << status.error().to_string();
  return status ? std::move(client) : nullptr;
}

/// Feeds a server that says this of itself after each sample.
Fed feed_to(const ServerStatus& status, const FeedPlan& plan) {
  std::promise<std::vector<MotionSamples>> heard;
  std::atomic<bool> stop = false;
  const FakeServer server([&](FakePeer& peer) {
    peer.welcome(test::make_welcome(2, 4));
    std::vector<MotionSamples> samples;
    while (samples.size() < kSamples) {
      const auto motion = peer.read_until<MotionSamples>();
      if (!motion) break;
      samples.push_back(*motion);
      peer.send(status);
    }
    heard.set_value(samples);
    stop = true;
    peer.read_to_end();
  });
  ClientConfig config = config_for(server.port());
  config.hello.role = Role::Source;
  Fed fed;
  std::unique_ptr<SteadyClient> client = joined(config);
  if (client == nullptr) return fed;
  const auto done = feed({&client, 1}, plan, stop, {});
  EXPECT_TRUE(done) << done.error().to_string();
  if (done) fed.progress = *done;
  client.reset();
  fed.heard = heard.get_future().get();
  return fed;
}

double x_m(const MotionSamples& motion) {
  return motion.samples.front().world_from_head.position_m.x;
}

double seconds_between(const MotionSamples& a, const MotionSamples& b) {
  return static_cast<double>(b.samples.front().time_ns - a.samples.front().time_ns) * 1e-9;
}

// The speed of what is played and what is said of it are the same thing.
void expect_as_said(const Fed& fed) {
  ASSERT_EQ(fed.heard.size(), kSamples);
  for (size_t i = 1; i < kSamples; ++i) {
    const double passed_s = seconds_between(fed.heard[i - 1], fed.heard[i]);
    EXPECT_NEAR(x_m(fed.heard[i]) - x_m(fed.heard[i - 1]), passed_s * (1.0 - fed.heard[i].held_back), 1e-9);
  }
}

TEST(Feed, ASlowSimulationIsFedInSlowMotion) {
  const Fed fed = feed_to(status_of(0.25), plan_of(false));
  expect_as_said(fed);
  EXPECT_NEAR(fed.heard.back().held_back, 0.75, 1e-3);
  EXPECT_NEAR(fed.progress.pace, 0.25, 1e-3);
  EXPECT_LT(fed.progress.motion_s, 0.9 * fed.progress.elapsed_s);
}

// A start that takes a tenth of a second is no fault that a person has to read about.
TEST(Feed, SaysSlowMotionOfASimulationThatIsSlowAndNotOfItsStart) {
  const auto said = [](double motion_s, double elapsed_s, double speed) {
    FeedProgress done;
    done.motion_s = motion_s;
    done.elapsed_s = elapsed_s;
    return slow_motion_sentence(done, speed);
  };
  EXPECT_EQ(said(4.3, 4.4, 1.0), "");
  EXPECT_EQ(said(0.8, 1.0, 1.0), "") << "its first moments";
  EXPECT_EQ(said(58.5, 60.0, 1.0), "") << "as good as real time";
  EXPECT_EQ(said(4.4, 2.2, 2.0), "") << "as fast as it is asked for";
  EXPECT_THAT(said(4.3, 8.6, 1.0), testing::StartsWith("slow motion: 4.3 s of the motion in 8.6 s"));
  EXPECT_THAT(said(4.3, 4.4, 2.0), testing::StartsWith("slow motion"));
}

TEST(Feed, SaysWhyItFailedOfWhichMoreThanATenthIsRefused) {
  FeedPlan plan = plan_of(true);
  EXPECT_EQ(refusal_sentence(feed_to(status_of(1.0), plan).progress), "");
  plan.motion = [](double) { return Pose{{3e4, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}}; };
  EXPECT_THAT(refusal_sentence(feed_to(status_of(1.0), plan).progress),
              testing::AllOf(testing::HasSubstr("samples were left out by the server: the head is 3e+04 m"),
                             testing::EndsWith("is its unit right (--unit)?")));
}

TEST(Feed, APausedSimulationHoldsTheMotion) {
  const Fed fed = feed_to(status_of(0.0, true), plan_of(false));
  expect_as_said(fed);
  EXPECT_EQ(fed.heard.back().held_back, 1.0);
  EXPECT_EQ(x_m(fed.heard.back()), x_m(fed.heard[kSamples - 2]));
}

TEST(Feed, JointsOfTheBodyGoWithTheHead) {
  FeedPlan plan = plan_of(true);
  plan.joint_names = {"neck", "left_shoulder"};
  plan.joints = [](double t_s) { return std::vector<glm::dvec3>{{0.0, -0.1, 0.0}, {0.2, -0.2, t_s}}; };
  const Fed fed = feed_to(status_of(1.0), plan);
  ASSERT_EQ(fed.heard.size(), kSamples);
  for (const MotionSamples& motion : fed.heard) {
    EXPECT_EQ(motion.joint_names, plan.joint_names);
    ASSERT_EQ(motion.samples.front().joint_m.size(), 2u);
    EXPECT_NEAR(motion.samples.front().joint_m[1].z, x_m(motion), 1e-6) << "of one time";
  }
}

TEST(Feed, AStageGoesOnInRealTime) {
  const Fed fed = feed_to(status_of(0.25), plan_of(true));
  expect_as_said(fed);
  EXPECT_EQ(fed.heard.back().held_back, 0.0);
  EXPECT_NEAR(fed.progress.motion_s, fed.progress.elapsed_s, 1e-9);
}

TEST(Feed, AFileEndsWithItsMotionHoweverSlowlyItIsPlayed) {
  FeedPlan plan = plan_of(false);
  plan.motion_s = 0.05;
  std::promise<std::vector<double>> heard;
  const FakeServer server([&](FakePeer& peer) {
    peer.welcome(test::make_welcome(2, 4));
    std::vector<double> place_m;
    while (const auto message = peer.read_until<MotionSamples>()) {
      place_m.push_back(message->samples.back().world_from_head.position_m.x);
      peer.send(status_of(0.5));
    }
    heard.set_value(place_m);
  });
  ClientConfig config = config_for(server.port());
  config.hello.role = Role::Source;
  std::unique_ptr<SteadyClient> client = joined(config);
  ASSERT_NE(client, nullptr);
  const std::atomic<bool> stop = false;
  const auto done = feed({&client, 1}, plan, stop, {});
  ASSERT_TRUE(done) << done.error().to_string();
  EXPECT_EQ(done->motion_s, 0.05);
  EXPECT_GT(done->elapsed_s, 0.06);
  client.reset();
  const std::vector<double> place_m = heard.get_future().get();
  ASSERT_GT(place_m.size(), 10u);
  EXPECT_EQ(place_m.back(), plan.motion(plan.motion_s).position_m.x) << "the end itself";
}

// Who is held up sends no burst of what was missed. It was one up to 250 ms: with that limit nothing is
// skipped.
TEST(Feed, AFeederThatWasHeldUpSkipsToNow) {
  constexpr auto kHeldUp = std::chrono::milliseconds(120);
  FeedPlan plan = plan_of(true);
  std::atomic<bool> stop = false;
  std::vector<double> time_s, place_m;
  const SendMoment send = [&](const MocapMoment& moment) {
    time_s.push_back(moment.time_s);
    place_m.push_back(moment.world_from_head.position_m.x);
    if (time_s.size() == 10) std::this_thread::sleep_for(kHeldUp);
    stop = time_s.size() == 20;
    return true;
  };
  const FeedProgress done = feed_moments(send, plan, stop, {});
  EXPECT_GE(done.skipped_samples, 20u) << "of 24";
  ASSERT_EQ(time_s.size(), 20u);
  EXPECT_GT(time_s[10] - time_s[9], 0.1);
  for (size_t i = 1; i < time_s.size(); ++i)
    EXPECT_NEAR(place_m[i] - place_m[i - 1], time_s[i] - time_s[i - 1], 1e-9) << "no faster than it moves";
}

TEST(Feed, FollowsAPaceHalfwayWithEveryWordAndIsExactInRealTime) {
  EXPECT_EQ(follow_pace(1.0, status_of(0.2)), 0.6);
  EXPECT_EQ(follow_pace(0.6, status_of(0.2)), 0.4);
  EXPECT_EQ(follow_pace(1.0, status_of(0.98)), 1.0);
  EXPECT_EQ(follow_pace(0.98, status_of(1.02)), 1.0) << "and not for ever nearly";
  EXPECT_EQ(follow_pace(0.7, status_of(0.7, true)), 0.0);
}

}  // namespace
}  // namespace strandcast::feed_test
