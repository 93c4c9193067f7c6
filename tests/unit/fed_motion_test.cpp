// What a feeder makes of a clip: it begins from rest, comes back to its start as gently as it moves itself,
// and leaves out frames that are not of the motion.
#include <gmock/gmock.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "client/app/ctl_commands.h"
#include "client/app/hair_origin.h"
#include "common/base/file.h"
#include "common/motion/clip_path.h"
#include "common/motion/motion_glitches.h"
#include "tests/support/made_abc.h"
#include "tests/support/shared_data.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::fed_motion_test {
namespace {

using testing::HasSubstr;

constexpr double kRateHz = 120.0;
constexpr double kMost = 1.5;  // of the clip's own peaks
// With the blending off a loop or a start is at least so many times as violent as the clip.
constexpr double kJumpLeast = 2.0;

struct FedClip {
  std::string name;
  std::filesystem::path path;
};

/// Somebody who walks 2 m, nods, and turns by 60 degrees; the first frame is 58 mm and 17.5 degrees off.
std::string walk_with_t_pose(int frames = 361) {
  std::string text =
      "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation "
      "Yrotation\n"
      "JOINT Head\n{\nOFFSET 0 1.6 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{\nOFFSET 0 0.2 "
      "0\n}\n}\n}\n";
  text += fmt::format("MOTION\nFrames: {}\nFrame Time: {}\n", frames, 1.0 / kRateHz);
  for (int i = 0; i < frames; ++i) {
    const double t_s = i / kRateHz;
    const double off_m = i == 0 ? 0.058 : 0.0;
    const double off_deg = i == 0 ? 17.5 : 0.0;
    text += fmt::format("{} {} {} 0 0 0 0 {} {}\n", off_m, 0.03 * std::sin(12.6 * t_s), 0.7 * t_s,
                        10.0 * std::sin(8.0 * t_s), off_deg + 20.0 * t_s);
  }
  return text;
}

class FedMotion : public testing::Test {
 protected:
  void SetUp() override {
    const auto path = folder_.path() / "walk.bvh";
    const std::string text = walk_with_t_pose();
    ASSERT_TRUE(save_file(path, std::as_bytes(std::span(text))));
    clips_.push_back({"walk", path});
    const std::filesystem::path shared = std::filesystem::path(STRANDCAST_SHARED_DATA) / "mocap";
    for (const char* name :
         {"cmu_01_01_playground_jumps.bvh", "cmu_05_20_mb.bvh", "cmu_131_01.bvh", "cmu_60_02_scaled.bvh",
          "cmu_61_05_scaled.bvh", "fair1_dab.bvh", "pirouette.bvh"})
      if (std::filesystem::exists(shared / name)) clips_.push_back({name, shared / name});
  }

  static MotionClip clip_of(const FedClip& fed, bool keeps_first_frames = false) {
    MotionFileOptions options;
    options.is_keeping_first_frames = keeps_first_frames;
    auto file = load_motion_file(fed.path, options);
    EXPECT_TRUE(file) << file.error().to_string();
    return file ? std::move(file->clip) : MotionClip{};
  }

  /// What is fed in so many seconds, after a head that rested where the motion begins.
  static std::vector<Pose> fed(const FeedOptions& options, double seconds) {
    const auto plan = make_feed_plan(options);
    EXPECT_TRUE(plan) << plan.error().to_string();
    if (!plan) return {};
    std::vector<Pose> poses(3, plan->motion(0.0));
    for (int i = 1; i < seconds * kRateHz; ++i) poses.push_back(plan->motion(i / kRateHz));
    return poses;
  }
  static FeedOptions options_for(const FedClip& clip) {
    FeedOptions options;
    options.motion = clip.path.string();
    options.wind = "none";
    options.is_keeping_facing = true;
    return options;
  }
  static MotionPeaks own_peaks(const MotionClip& clip) {
    std::vector<Pose> poses;
    for (int i = 0; i / kRateHz < clip.duration_s(); ++i) poses.push_back(clip.sample(i / kRateHz));
    return peaks_of(poses, 1.0 / kRateHz);
  }

  const TemporaryFolder folder_;
  std::vector<FedClip> clips_;
};

TEST_F(FedMotion, ComesBackToItsStartAsItMovesItself) {
  for (const FedClip& clip : clips_) {
    SCOPED_TRACE(clip.name);
    const MotionPeaks own = own_peaks(clip_of(clip));
    FeedOptions options = options_for(clip);
    options.is_looped = true;
    const double twice_s = 2.0 * clip_of(clip).duration_s() + kLongestWayBackS;
    EXPECT_TRUE(peaks_of(fed(options, twice_s), 1.0 / kRateHz).is_within(own, kMost));
    options.blend_s = 0.0;
    EXPECT_FALSE(peaks_of(fed(options, twice_s), 1.0 / kRateHz).is_within(own, kJumpLeast));
  }
}

TEST_F(FedMotion, BeginsFromRest) {
  // In the middle of a stride: at once, the head would be at full speed from one sample to the next.
  const FedClip& walk = clips_.front();
  const MotionPeaks own = own_peaks(clip_of(walk));
  FeedOptions options = options_for(walk);
  EXPECT_TRUE(peaks_of(fed(options, 1.0), 1.0 / kRateHz).is_within(own, kMost));
  options.blend_s = 0.0;
  EXPECT_GT(peaks_of(fed(options, 1.0), 1.0 / kRateHz).mps2, 10.0 * own.mps2);
  options = {};
  options.wind = "none";
  EXPECT_LT(peaks_of(fed(options, 1.0), 1.0 / kRateHz).mps2, 5.0) << "the built-in motion, likewise";
  options.blend_s = 0.0;
  EXPECT_GT(peaks_of(fed(options, 1.0), 1.0 / kRateHz).mps2, 20.0);
}

/// In the middle of a stride from its first frame on.
MotionClip run_of(double speed_mps, double spin_rad_per_s) {
  MotionClip clip;
  clip.frame_s = 1.0 / kRateHz;
  for (int i = 0; i < 600; ++i) {
    const double t_s = i * clip.frame_s;
    clip.world_from_head.push_back({{speed_mps * t_s, 0.03 * std::sin(12.6 * t_s), 0.0},
                                    glm::angleAxis(spin_rad_per_s * t_s, glm::dvec3(0.0, 1.0, 0.0))});
  }
  return clip;
}

// The faster a clip begins, the longer the head takes to get under way.
TEST(ClipStart, NeedsNoMoreThanAnEasyStart) {
  EXPECT_EQ(ClipPath(run_of(0.0, 0.0), {}).start_s(), kClipBlendS);
  for (const auto& [speed_mps, spin_rad_per_s] : {std::pair{2.3, 0.0}, {0.0, 6.0}, {1.3, 3.0}}) {
    const auto peaks_until = [&](const ClipPath& path, double until_s) {
      std::vector<Pose> poses;
      for (double t_s = -0.1; t_s < until_s; t_s += 1.0 / 60.0)
        poses.push_back(path.sample(std::max(t_s, 0.0)));
      return peaks_of(poses, 1.0 / 60.0);
    };
    const ClipPath path(run_of(speed_mps, spin_rad_per_s), {});
    EXPECT_LT(path.start_s(), kLongestStartS);
    const MotionPeaks own = peaks_until(path, path.start_s());
    EXPECT_LE(own.mps2, 1.05 * kEasyStart.mps2);
    EXPECT_LE(own.rad_per_s2, 1.05 * kEasyStart.rad_per_s2);
    // The counter-example: in the shortest time that a start takes it is a blow.
    MotionClip clip = run_of(speed_mps, spin_rad_per_s);
    std::vector<Pose> hasty(6, clip.sample(0.0));
    for (double t_s = 0.0; t_s < kClipBlendS; t_s += 1.0 / 60.0)
      hasty.push_back(clip.sample(time_from_rest_s(t_s, kClipBlendS)));
    const MotionPeaks blow = peaks_of(hasty, 1.0 / 60.0);
    EXPECT_TRUE(blow.mps2 > 1.4 * kEasyStart.mps2 || blow.rad_per_s2 > 1.4 * kEasyStart.rad_per_s2);
  }
  EXPECT_EQ(ClipPath(run_of(20.0, 0.0), {}).start_s(), kLongestStartS) << "nothing takes longer";
}

TEST_F(FedMotion, IsAllOfTheClipOnce) {
  const FedClip& walk = clips_.front();
  const auto plan = make_feed_plan(options_for(walk));
  ASSERT_TRUE(plan);
  const MotionClip clip = clip_of(walk);
  const double start_s = ClipPath(clip, {}).start_s();
  EXPECT_GE(start_s, kClipBlendS);
  EXPECT_EQ(plan->motion_s, clip.duration_s() + 0.5 * start_s) << "a start lags by half of itself";
  EXPECT_EQ(plan->motion(plan->motion_s), clip.world_from_head.back());
  EXPECT_EQ(plan->motion(0.0), clip.world_from_head.front());
}

// A pose is a motion of one frame: the head is held there for as long as it is fed.
TEST_F(FedMotion, OneFrameIsHeldAndSaid) {
  for (const bool is_looped : {false, true}) {
    const auto path = folder_.path() / "pose.bvh";
    const std::string text = walk_with_t_pose(1);
    ASSERT_TRUE(save_file(path, std::as_bytes(std::span(text))));
    FeedOptions options = options_for({"pose", path});
    options.is_looped = is_looped;
    testing::internal::CaptureStderr();
    const auto plan = make_feed_plan(options);
    EXPECT_THAT(testing::internal::GetCapturedStderr(),
                HasSubstr("pose.bvh: one frame: the head is held there"));
    ASSERT_TRUE(plan) << plan.error().to_string();
    EXPECT_EQ(plan->motion_s, 0.0) << "without end";
    for (const double t_s : {0.0, 0.1, 5.0, 1e4}) EXPECT_EQ(plan->motion(t_s), plan->motion(0.0)) << t_s;
  }
  testing::internal::CaptureStderr();
  EXPECT_GT(make_feed_plan(options_for(clips_.front()))->motion_s, 0.0);
  EXPECT_THAT(testing::internal::GetCapturedStderr(), testing::Not(HasSubstr("one frame")));
}

TEST_F(FedMotion, LeavesOutFramesBeforeTheMotion) {
  const FedClip& walk = clips_.front();
  const MotionClip kept = clip_of(walk, true), clip = clip_of(walk);
  ASSERT_EQ(clip.world_from_head.size() + 1, kept.world_from_head.size());
  EXPECT_EQ(clip.world_from_head.front().rotation, kept.world_from_head[1].rotation);
  EXPECT_EQ(clip.world_from_head.front().position_m.x, 0.0) << "recentred";
  const FirstFrames first = find_first_frames(kept);
  EXPECT_EQ(first.count, 1u);
  EXPECT_NEAR(first.jump_m, 0.058, 0.01);
  EXPECT_NEAR(first.jump_deg, 17.5, 0.5);
  // Kept, the head turns an order faster than anywhere in the motion.
  EXPECT_GT(own_peaks(kept).rad_per_s, 10.0 * own_peaks(clip).rad_per_s);
  testing::internal::CaptureStderr();
  EXPECT_TRUE(make_feed_plan(options_for(walk)));
  EXPECT_THAT(testing::internal::GetCapturedStderr(), HasSubstr("walk.bvh: 1 of its frames left out"));
}

/// Mean direction of the face in a second, level.
glm::dvec3 facing_of(const FeedPlan& plan) {
  glm::dvec3 sum(0.0);
  for (int i = 0; i < 60; ++i) sum += plan.motion(i / 60.0).rotation * glm::dvec3(0, 0, 1);
  return glm::normalize(sum * glm::dvec3(1, 0, 1));
}

// What is called front is so of the clip, whichever way it faced on its stage; its wind keeps its side.
TEST_F(FedMotion, AClipThatLooksAsideIsTurnedWithItsWind) {
  const auto path = folder_.path() / "aside.bvh", wind = folder_.path() / "wind.csv";
  const std::string csv = "t_s,x_mps,y_mps,z_mps\n0,3,0,0\n1,3,0,0\n";
  ASSERT_TRUE(save_file(wind, std::as_bytes(std::span(csv))));
  const auto plan_at = [&](double yaw_deg, bool keeps) {
    std::string text =
        "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 4 Xposition Yposition Zposition Yrotation\nJOINT "
        "Head\n{\nOFFSET 0 1.6 0\nCHANNELS 1 Yrotation\nEnd Site\n{\nOFFSET 0 0.2 "
        "0\n}\n}\n}\nMOTION\nFrames: "
        "121\nFrame Time: 0.01\n";
    // Walks 1 m where it looks, and looks 20 degrees to both sides of that.
    for (int i = 0; i <= 120; ++i)
      text += fmt::format("{} 0 {} {} {}\n", 0.01 * i * std::sin(glm::radians(yaw_deg)),
                          0.01 * i * std::cos(glm::radians(yaw_deg)), yaw_deg,
                          20.0 * std::sin(glm::radians(3.0 * i)));
    EXPECT_TRUE(save_file(path, std::as_bytes(std::span(text))));
    FeedOptions options;
    options.motion = path.string();
    options.wind = wind.string();
    options.blend_s = 0.0;
    options.is_keeping_facing = keeps;
    auto plan = make_feed_plan(options);
    EXPECT_TRUE(plan) << plan.error().to_string();
    return std::move(plan).value();
  };
  const FeedPlan ahead = plan_at(0.0, false);
  EXPECT_EQ(ahead.wind(0.5), glm::vec3(3, 0, 0)) << "nothing to turn";
  for (const double yaw_deg : {90.0, 180.0, -135.0, 12.0}) {
    SCOPED_TRACE(yaw_deg);
    const FeedPlan turned = plan_at(yaw_deg, false), kept = plan_at(yaw_deg, true);
    const double yaw_rad = glm::radians(yaw_deg);
    const glm::dvec3 aside(std::sin(yaw_rad), 0.0, std::cos(yaw_rad));
    EXPECT_GT(glm::dot(facing_of(kept), aside), 0.99) << "as the file has it";
    EXPECT_GT(facing_of(turned).z, 0.99);
    // The same as the clip that looks ahead, wind too: it blew from 90 - yaw degrees off the face.
    EXPECT_LT(glm::distance(turned.motion(0.7).position_m, ahead.motion(0.7).position_m), 1e-9);
    const glm::dquat back = glm::angleAxis(-yaw_rad, glm::dvec3(0, 1, 0));
    EXPECT_LT(glm::distance(glm::dvec3(turned.wind(0.5)), back * glm::dvec3(3, 0, 0)), 1e-5);
    EXPECT_EQ(kept.wind(0.5), glm::vec3(3, 0, 0));
  }
}

// The share of the frames' peaks is that of captures with a T-pose before them; the others have none.
TEST_F(FedMotion, CapturesAreFedWithoutTheirTPose) {
  const std::filesystem::path folder = std::filesystem::path(STRANDCAST_SHARED_DATA) / "mocap";
  REQUIRE_SHARED(folder);
  uint32_t begun_with_one = 0;
  for (const FedClip& clip : clips_) {
    SCOPED_TRACE(clip.name);
    const MotionClip kept = clip_of(clip, true), without = clip_of(clip);
    EXPECT_EQ(find_first_frames(without).count, 0u);
    if (kept.world_from_head.size() == without.world_from_head.size()) continue;
    ++begun_with_one;
    const auto begin_of = [](MotionClip whole) {
      whole.world_from_head.resize(static_cast<size_t>(0.3 / whole.frame_s));
      return peaks_of(whole.world_from_head, whole.frame_s);
    };
    EXPECT_FALSE(begin_of(kept).is_within(begin_of(without), 2.0));
  }
  EXPECT_GE(begun_with_one, 3u);
}

TEST(FirstFrames, AreNoneOfAMotionThatIsItself) {
  MotionClip clip;
  clip.frame_s = 0.01;
  for (int i = 0; i < 100; ++i) clip.world_from_head.push_back({{0.02 * i, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}});
  EXPECT_EQ(find_first_frames(clip).count, 0u) << "evenly fast";
  for (Pose& pose : clip.world_from_head) pose.position_m *= 1e-6;
  clip.world_from_head.front().position_m.x = -1e-3;
  EXPECT_EQ(find_first_frames(clip).count, 0u) << "a still head that stirs";
  clip.world_from_head.front().position_m.x = -0.1;
  EXPECT_EQ(find_first_frames(clip).count, 1u);
  clip.world_from_head[3].position_m.x = -0.1;
  EXPECT_EQ(find_first_frames(clip).count, 4u) << "up to the last jump";
  MotionClip held = clip;
  held.world_from_head.insert(held.world_from_head.begin(), 60, clip.world_from_head.front());
  EXPECT_EQ(find_first_frames(held).count, 61u) << "held for 0.6 s";
  clip.world_from_head.resize(20);
  EXPECT_EQ(find_first_frames(clip).count, 0u) << "too short to judge";
}

TEST_F(FedMotion, ACheckSaysWhatAClipIsTakenForAndFailsForWhatNoHeadDoes) {
  const std::atomic<bool> stop = false;
  FeedOptions options = options_for(clips_.front());
  options.is_checking = true;
  const auto check = [&] {
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    const int code = run_feed({"127.0.0.1:1", {}, {}, false, {}, nullptr, {}}, options, stop);
    return std::tuple(code, testing::internal::GetCapturedStdout(), testing::internal::GetCapturedStderr());
  };
  const auto [good, taken, noted] = check();
  EXPECT_EQ(good, kDoneExit) << "without a server";
  EXPECT_THAT(taken, HasSubstr("walk.bvh: 360 frames, 120 per second; one unit is 1 m and +Y is up: the head "
                               "is 1.57 to 1.63 m up, and looks 30 degrees from +Z towards +X on the mean"));
  EXPECT_THAT(noted, AllOf(HasSubstr("the head is Head"), HasSubstr("1 of its frames left out")));
  options.motion_file.unit_m = 0.01;
  const auto [wrong, small, doubted] = check();
  EXPECT_EQ(wrong, kRefusedExit);
  EXPECT_THAT(small, HasSubstr("one unit is 0.01 m"));
  EXPECT_EQ(doubted.find("as of no body"), doubted.rfind("as of no body")) << doubted;
  EXPECT_THAT(doubted, HasSubstr("strandcast-ctl: "));
  options.motion_file.joint = "Nose";
  EXPECT_EQ(std::get<0>(check()), kBadInputExit);
}

/// Hair that walks, with these times of its samples.
CurveMotion walk_of_curves(const std::vector<double>& time_s) {
  CurveMotion motion{time_s, {}, 1, 9};
  for (const double t_s : time_s)
    motion.from_first.push_back({{0.7 * t_s, 0.03 * std::sin(6.3 * t_s), 0.2},
                                 glm::angleAxis(0.3 * std::sin(4.0 * t_s), glm::dvec3(0.0, 1.0, 0.0))});
  return motion;
}

// Curves leave another program as often with a T-pose as a clip does.
TEST(HeadUnderCurves, IsJudgedAsThatOfAClip) {
  std::vector<double> time_s;
  for (int i = 0; i < 60; ++i) time_s.push_back(i / 24.0);
  CurveMotion motion = walk_of_curves(time_s);
  const MotionFile walk = head_motion(motion, {}, "a.abc", {});
  EXPECT_EQ(walk.clip.world_from_head.size(), 60u);
  EXPECT_THAT(walk.unlikely, testing::IsEmpty());
  motion.from_first[0] = {{-0.5, 0.0, 0.3}, glm::angleAxis(0.7, glm::dvec3(1.0, 0.0, 0.0))};
  const MotionFile judged = head_motion(motion, {}, "a.abc", {});
  ASSERT_EQ(judged.clip.world_from_head.size(), 59u);
  EXPECT_LT(glm::distance(judged.clip.world_from_head[0].position_m, motion.from_first[1].position_m), 1e-9)
      << "where the file has it";
  EXPECT_THAT(judged.notes, testing::Contains(HasSubstr("a.abc: 1 of its frames left out")));
  MotionFileOptions keeps, filters;
  keeps.is_keeping_first_frames = filters.is_filtering_glitches = true;
  EXPECT_EQ(head_motion(motion, {}, "a.abc", keeps).clip.world_from_head.size(), 60u);
  motion.from_first[30].position_m.y += 3.0;
  EXPECT_THAT(head_motion(motion, {}, "a.abc", {}).unlikely,
              testing::ElementsAre(HasSubstr("the head makes 2 steps faster")));
  EXPECT_THAT(head_motion(motion, {}, "a.abc", filters).unlikely, testing::IsEmpty());
}

TEST(HeadUnderCurves, PassesSamplesAtTheirUnevenTimes) {
  const CurveMotion motion = walk_of_curves({0.0, 0.1, 0.15, 0.3, 0.35, 0.6});
  const MotionClip clip = head_motion(motion, {}, "a.abc", {}).clip;
  EXPECT_DOUBLE_EQ(clip.duration_s(), 0.6);
  for (size_t i = 0; i < motion.time_s.size(); ++i)
    EXPECT_LT(glm::distance(clip.sample(motion.time_s[i]).position_m, motion.from_first[i].position_m), 1e-9)
        << i;
}

TEST_F(FedMotion, CurvesMoveNothingWhereNobodyKnowsTheirHair) {
  FeedOptions options;
  options.motion = (folder_.path() / "moving.abc").string();
  EXPECT_EQ(make_feed_plan(options).error().code, ErrorCode::NotFound);
  test::MadeCurves moving;
  moving.shift = {0.0f, 1.0f};
  test::MadeAbc made(options.motion);
  made.finish({made.curves(moving)});
  EXPECT_THAT(make_feed_plan(options).error().to_string(),
              AllOf(HasSubstr("moving.abc"), HasSubstr("only feed to a server, and bake, know it")));
}

}  // namespace
}  // namespace strandcast::fed_motion_test
