// libFuzzer entry: motion and wind samples of several hostile sources in the input hub. Steps of a byte for
// the kind, then its numbers as they are.
#include <cmath>

#include "common/base/check.h"
#include "server/input/input_hub.h"
#include "tests/fuzz/fuzz_input.h"

namespace strandcast::input_hub_fuzz {
namespace {

enum class Step : uint8_t { Motion, Wind, Leave, Sample, SampleAnywhere };
constexpr int kStepKinds = 5;
constexpr int kMostSteps = 400;

struct HubGame {
  InputHub hub;
  int64_t now_ns = 1;
  uint64_t pushed_count = 0;

  /// A time near the present one, or any at all.
  int64_t take_time(FuzzInput& input) const {
    const auto kind = input.take<uint8_t>();
    return (kind & 1) != 0 ? input.take<int64_t>() : now_ns + input.take<int32_t>();
  }
  /// Numbers of everyday size, or any at all.
  double take_number(FuzzInput& input, uint8_t kind) const {
    return (kind & 2) != 0 ? input.take<double>() : input.take<int16_t>() * 0x1p-12;
  }

  void push_motion(FuzzInput& input) {
    const uint64_t source = input.take<uint8_t>();
    const auto kind = input.take<uint8_t>();
    MotionSamples message;
    for (int i = 0; i < (kind >> 6) + 1; ++i) {
      MotionSamples::Sample sample;
      sample.time_ns = take_time(input);
      for (int axis = 0; axis < 3; ++axis) sample.world_from_head.position_m[axis] = take_number(input, kind);
      for (int k = 0; k < 4; ++k) sample.world_from_head.rotation[k] = take_number(input, kind);
      for (int joint = 0; (kind & 4) != 0 && joint < (kind >> 3) % 4; ++joint)
        sample.joint_m.emplace_back(take_number(input, kind), take_number(input, kind),
                                    take_number(input, kind));
      message.samples.push_back(sample);
    }
    if ((kind & 4) != 0) message.joint_names.resize((kind >> 3) % 4, "joint");
    pushed_count += message.samples.size();
    hub.push(source, message, now_ns);
  }

  void push_wind(FuzzInput& input) {
    const uint64_t source = input.take<uint8_t>();
    const auto kind = input.take<uint8_t>();
    WindSamples message;
    for (int i = 0; i < (kind >> 6) + 1; ++i) {
      WindSamples::Sample sample;
      sample.time_ns = take_time(input);
      for (int axis = 0; axis < 3; ++axis)
        sample.velocity_mps[axis] =
            (kind & 2) != 0 ? input.take<float>() : static_cast<float>(take_number(input, kind));
      message.samples.push_back(sample);
    }
    pushed_count += message.samples.size();
    hub.push(source, message, now_ns);
  }

  void check_frame(const InputFrame& frame) const {
    CHECK(is_finite(frame.world_from_head));
    constexpr double kTolerance = 1e-6;
    CHECK(std::abs(glm::length(frame.world_from_head.rotation) - 1.0) <= kTolerance);
    CHECK(glm::length(frame.world_from_head.position_m) <= kMaxHeadDistanceM * (1.0 + kTolerance));
    CHECK(frame.joints.name.size() == frame.joints.place_m.size() &&
          frame.joints.name.size() <= kMaxMotionJoints);
    for (const glm::dvec3& place_m : frame.joints.place_m)
      CHECK(glm::length(place_m) <= kMaxJointDistanceM * (1.0 + kTolerance));
    CHECK(glm::length(glm::dvec3(frame.wind_mps)) <= kMaxWindStreamMps * (1.0 + kTolerance));
    CHECK(frame.motion_time_ns <= now_ns);
    const InputCounters counters = hub.counters();
    CHECK(counters.accepted + counters.rejected() == pushed_count);
  }
};

}  // namespace

extern "C" int FUZZ_ENTRY(input_hub)(const uint8_t* data, size_t size) {
  FuzzInput input(data, size);
  HubGame game;
  for (int i = 0; i < kMostSteps && !input.is_empty(); ++i) {
    game.now_ns += input.take<uint16_t>() * int64_t{100'000};
    switch (static_cast<Step>(input.take<uint8_t>() % kStepKinds)) {
      case Step::Motion:
        game.push_motion(input);
        break;
      case Step::Wind:
        game.push_wind(input);
        break;
      case Step::Leave:
        game.hub.remove_source(input.take<uint8_t>());
        break;
      case Step::Sample:
        game.check_frame(game.hub.sample(game.now_ns));
        break;
      case Step::SampleAnywhere:
        game.check_frame(game.hub.sample(game.take_time(input)));
        break;
    }
  }
  return 0;
}

}  // namespace strandcast::input_hub_fuzz
