// libFuzzer entry: poses of any numbers, in any order and at any time, in the policy of live inputs. What
// comes out is always somewhere, in order of time, and no faster than a head but for the jumps that are
// meant.
#include "server/input/live/live_policy.h"

#include <cmath>

#include "common/base/check.h"
#include "common/scene/body_desc.h"
#include "server/input/input_hub.h"
#include "tests/fuzz/fuzz_input.h"

namespace strandcast::live_policy_fuzz {
namespace {

constexpr int kMostSteps = 400;

/// Numbers of everyday size, or any at all.
double take_number(FuzzInput& input, uint8_t kind) {
  return (kind & 1) != 0 ? input.take<double>() : input.take<int16_t>() * 0x1p-13;
}

LivePose take_pose(FuzzInput& input) {
  const auto kind = input.take<uint8_t>();
  LivePose pose;
  for (int axis = 0; axis < 3; ++axis) pose.world_from_subject.position_m[axis] = take_number(input, kind);
  for (int k = 0; k < 4; ++k) pose.world_from_subject.rotation[k] = take_number(input, kind);
  pose.has_position = (kind & 2) == 0;
  if ((kind & 4) != 0) pose.frame = (kind & 8) != 0 ? input.take<uint32_t>() : input.take<uint8_t>();
  if ((kind & 16) != 0)
    pose.source_time_ns =
        (kind & 32) != 0 ? input.take<int64_t>() : input.take<uint16_t>() * int64_t{1'000'000};
  for (int i = 0; (kind & 64) != 0 && i < 3; ++i) {
    pose.joint_names.push_back(i == 1 ? "neck" : "chest");
    pose.joint_m.emplace_back(take_number(input, kind), take_number(input, kind), take_number(input, kind));
  }
  return pose;
}

struct PolicyGame {
  LivePolicy policy;
  int64_t now_ns = 1;
  std::optional<LiveHead> before;

  void look() {
    for (const LiveHead& head : policy.advance(now_ns)) {
      CHECK(is_finite(head.world_from_head));
      CHECK(std::abs(glm::length(head.world_from_head.rotation) - 1.0) <= 1e-6);
      CHECK(head.joint_names.size() == head.joint_m.size() && head.joint_names.size() <= kMaxMotionJoints);
      if (before) {
        CHECK(head.time_ns > before->time_ns);
        check_speed(*before, head);
      }
      before = head;
    }
    const LivePolicyCounters& counters = policy.counters();
    CHECK(counters.late + counters.gated + counters.impossible <= poses);
  }
  /// What the hub takes for a jump is meant.
  static void check_speed(const LiveHead& a, const LiveHead& b) {
    const double passed_s = static_cast<double>(b.time_ns - a.time_ns) * 1e-9;
    const double way_m = glm::distance(a.world_from_head.position_m, b.world_from_head.position_m);
    const double turn_rad = angle_between_rad(a.world_from_head.rotation, b.world_from_head.rotation);
    constexpr double kJumpS = 1.5e-3;  // jumps come this soon after the pose before
    const double window_s = static_cast<double>(kClampWindowNs) * 1e-9 + passed_s;
    CHECK(passed_s <= kJumpS || way_m <= kMaxLiveSpeedMps * window_s + 1e-6);
    CHECK(passed_s <= kJumpS || turn_rad <= kMaxLiveTurnRadPerS * window_s + 1e-6);
  }

  uint64_t poses = 0;
};

}  // namespace

extern "C" int FUZZ_ENTRY(live_policy)(const uint8_t* data, size_t size) {
  FuzzInput input(data, size);
  PolicyGame game;
  for (int i = 0; i < kMostSteps && !input.is_empty(); ++i) {
    game.now_ns += input.take<uint16_t>() * int64_t{20'000};
    switch (input.take<uint8_t>() % 8) {
      case 0:
        game.policy.begin_another();
        break;
      case 1:
        (void)game.policy.calibrate(game.now_ns);
        break;
      case 2:
        game.policy.reset_calibration();
        break;
      default:
        game.policy.take(take_pose(input), game.now_ns);
        ++game.poses;
    }
    game.look();
  }
  return 0;
}

}  // namespace strandcast::live_policy_fuzz
