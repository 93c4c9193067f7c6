// Timecode of states: a camera's clock drifts and its packets come unevenly, and still each state has the
// timecode of the motion that it shows.
#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <random>

#include "common/base/units.h"
#include "server/input/input_hub.h"

namespace strandcast::state_timecode_test {
namespace {

constexpr double kRunS = 600.0;
constexpr double kDrift = 200e-6;
constexpr double kStepS = 1.0 / 60.0;
constexpr double kMPerFrame = 1e-3;  // that the head moves
constexpr int64_t kBegin = 7'000'000'000;

int64_t server_ns(double time_s) {
  return kBegin + std::llround(time_s * kNsPerS);
}

/// A camera: frame k begins at k / rate of its own clock, which goes faster by `drift`.
struct Camera {
  Timecode first;
  double drift = 0.0;

  double hz() const { return first.rate.hz(); }
  double frames_at(double time_s) const { return time_s * (1.0 + drift) * hz(); }
  double time_of_s(double frame) const { return frame / hz() / (1.0 + drift); }
};

/// Passes ten minutes: `send` with each frame, late by up to `jitter_s`, and `look` at each step.
void pass(const Camera& camera, double jitter_s,
          const std::function<void(int64_t frame, double time_s)>& send,
          const std::function<void(double time_s)>& look) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> late_s(0.0, jitter_s);
  int64_t frame = 0;
  double arrival_s = 0.0;
  for (double time_s = 0.0; time_s < kRunS; time_s += kStepS) {
    while (camera.time_of_s(static_cast<double>(frame)) + jitter_s < time_s) {
      arrival_s = std::max(arrival_s, camera.time_of_s(static_cast<double>(frame)) + late_s(random));
      send(frame++, arrival_s);
    }
    look(time_s);
  }
}

// The law of a take: which of the camera's frames hair shows is known within half a frame. What counts from
// the beginning by the server's clock alone is beyond two frames in the end.
TEST(StateTimecode, IsThatOfTheMotionThatItShowsOverTenMinutesOfDrift) {
  for (const FrameRate& rate : {FrameRate{24000, 1001}, FrameRate{25, 1}, FrameRate{30, 1}, FrameRate{60, 1}})
    for (const double drift : {kDrift, -kDrift}) {
      const Camera camera{*make_timecode({23, 55, 0, 0}, rate, false), drift};  // past midnight
      InputHub hub;
      double worst = 0.0, worst_counted = 0.0;
      pass(
          camera, 0.004,
          [&](int64_t frame, double time_s) {
            const auto source_ns = std::llround(static_cast<double>(frame) / camera.hz() * kNsPerS);
            MotionSamples samples{
                {{source_ns, {{kMPerFrame * static_cast<double>(frame), 0, 0}, {1, 0, 0, 0}}}}};
            samples.timecode = advanced(camera.first, static_cast<double>(frame));
            hub.push(1, samples, server_ns(time_s));
          },
          [&](double time_s) {
            const InputFrame frame = hub.sample(server_ns(time_s));
            if (!frame.has_motion) return;
            ASSERT_TRUE(frame.timecode);
            const double shown = frame.world_from_head.position_m.x / kMPerFrame;
            worst = std::max(worst, std::abs(frames_between(camera.first, *frame.timecode) - shown));
            worst_counted =
                std::max(worst_counted, std::abs(time_s * camera.hz() - camera.frames_at(time_s)));
          });
      EXPECT_LE(worst, 0.5) << rate.hz() << " Hz, drift " << drift;
      EXPECT_GT(worst_counted, 2.0);
    }
}

// As audio or a clock gives it: without motion, by the server's clock.
TEST(StateTimecode, OfAClockAloneIsWithinHalfAFrameOverTenMinutesOfDrift) {
  for (const FrameRate& rate : {FrameRate{24, 1}, FrameRate{30000, 1001}})
    for (const double drift : {kDrift, -kDrift}) {
      const Camera camera{*make_timecode({23, 55, 0, 0}, rate, false), drift};
      InputHub hub;
      double worst = 0.0;
      pass(
          camera, 0.02,
          [&](int64_t frame, double time_s) {
            hub.push(advanced(camera.first, static_cast<double>(frame)), server_ns(time_s));
          },
          [&](double time_s) {
            const InputFrame frame = hub.sample(server_ns(time_s));
            if (time_s < 1.0) return;
            ASSERT_TRUE(frame.timecode);
            const double shown = frames_between(camera.first, *frame.timecode);
            worst = std::max(worst, std::abs(shown - camera.frames_at(time_s)));
          });
      EXPECT_LE(worst, 0.5) << rate.hz() << " Hz, drift " << drift;
    }
}

TEST(StateTimecode, FollowsAJumpAndEndsWithItsSource) {
  InputHub hub;
  const Timecode hour = *parse_timecode("01:00:00:00", {25, 1});
  EXPECT_FALSE(hub.sample(kBegin).timecode);
  hub.push(hour, kBegin);
  EXPECT_NEAR(frames_between(hour, *hub.sample(kBegin + kSInNs).timecode), 25.0, 1e-6);
  const Timecode back = *parse_timecode("00:30:00:00", {25, 1});
  hub.push(back, kBegin + kSInNs);
  EXPECT_EQ(*hub.sample(kBegin + kSInNs).timecode, back);
  EXPECT_TRUE(hub.sample(kBegin + kSInNs + kTimecodeStaleNs).timecode);
  EXPECT_FALSE(hub.sample(kBegin + kSInNs + kTimecodeStaleNs + 1).timecode);
}

TEST(StateTimecode, OfMotionGoesBeforeThatOfAClock) {
  InputHub hub;
  const Timecode clock = *parse_timecode("10:00:00:00", {24, 1});
  MotionSamples samples{{{0, Pose{}}, {kSInNs, Pose{}}}};
  hub.push(1, samples, kBegin);
  hub.push(clock, kBegin);
  EXPECT_EQ(*hub.sample(kBegin).timecode, clock) << "of motion that has none";
  InputHub other;
  samples.timecode = *parse_timecode("01:00:00:00", {24, 1});
  other.push(1, samples, kBegin + kSInNs);
  other.push(clock, kBegin + kSInNs);
  const InputFrame frame = other.sample(kBegin + kSInNs);
  EXPECT_EQ(timecode_text(*frame.timecode), "01:00:01:00") << "of the second sample of the message";
  EXPECT_NEAR(frames_between(clock, *other.sample(kBegin + 3 * kSInNs).timecode), 48.0, 1e-6) << "of nobody";
}

TEST(StateTimecode, IsThatOfEachHeldSample) {
  InputHub hub;
  hub.hold_samples();
  MotionSamples samples{{{0, Pose{}}, {kSInNs / 2, Pose{}}, {kSInNs, Pose{}}}};
  samples.timecode = *parse_timecode("01:00:00:00", {24, 1});
  hub.push(1, samples, 0);
  EXPECT_EQ(timecode_text(*hub.sample(0).timecode), "01:00:00:00");
  EXPECT_EQ(timecode_text(*hub.sample(kSInNs / 2).timecode), "01:00:00:12");
  EXPECT_EQ(timecode_text(*hub.sample(kSInNs).timecode), "01:00:01:00");
}

}  // namespace
}  // namespace strandcast::state_timecode_test
