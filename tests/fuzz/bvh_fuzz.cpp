// libFuzzer entry: a BVH file. The first byte sets the options.
#include "common/base/check.h"
#include "common/motion/bvh.h"
#include "tests/fuzz/fuzz_input.h"

namespace strandcast::bvh_fuzz {

extern "C" int FUZZ_ENTRY(bvh)(const uint8_t* data, size_t size) {
  FuzzInput input(data, size);
  const auto settings = input.take<uint8_t>();
  BvhOptions options;
  if ((settings & 16) == 0) options.is_z_up = (settings & 1) != 0;
  options.skip_first_frame_if_t_pose = (settings & 2) != 0;
  options.recentre = (settings & 4) != 0;
  if ((settings & 8) != 0) options.unit_m = 0.01;
  const auto clip = parse_bvh(input.take_rest_as_text(), "fuzz", options);
  if (!clip) return 0;
  CHECK(!clip->world_from_head.empty() && clip->world_from_head.size() <= kMaxBvhFrames);
  CHECK(clip->frame_s >= kMinFrameTimeS && clip->frame_s <= kMaxFrameTimeS);
  for (const Pose& pose : clip->world_from_head) {
    constexpr double kTolerance = 1e-9;
    CHECK(is_finite(pose) && std::abs(glm::length(pose.rotation) - 1.0) <= kTolerance);
  }
  CHECK(is_finite(clip->sample(0.4 * clip->duration_s())));
  return 0;
}

}  // namespace strandcast::bvh_fuzz
