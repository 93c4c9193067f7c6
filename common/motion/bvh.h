// Head motion out of BVH motion capture files: the whole hierarchy is parsed, only the path from the root to
// the head is evaluated, in double. Input is untrusted: every limit is checked before anything is allocated.
// Any thread.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/motion/motion_clip.h"

namespace strandcast {

inline constexpr uint64_t kMaxBvhFileBytes = 256ull << 20;
inline constexpr uint32_t kMaxBvhJoints = 1'024;
inline constexpr uint32_t kMaxBvhDepth = 128;
inline constexpr uint32_t kMaxBvhFrames = 1'000'000;
inline constexpr double kMinFrameTimeS = 1e-4, kMaxFrameTimeS = 10.0;

/// Bones from the lowest to the highest point of a grown-up: the body, and the foot's length.
inline constexpr double kAssumedBodyHeightM = 1.7;

/// That clips give: as many as a motion stream takes.
inline constexpr size_t kMaxBodyJoints = 12;

struct LengthUnit {
  double m = 1.0;
  const char* name = "";  // of several, as in "bones of 180 cm"
};
/// Units that clips come in. CMU's unit, 1 / 0.45 of an inch, is that of its Acclaim files and of conversions
/// that keep their numbers.
inline constexpr LengthUnit kClipUnits[] = {
    {1e-3, "mm"}, {1e-2, "cm"},     {0.0254, "inches"}, {0.0254 / 0.45, "CMU's units"},
    {0.1, "dm"},  {0.3048, "feet"}, {1.0, "m"}};
/// A guess this near to one of them means that one.
inline constexpr double kUnitSnap = 0.25;

/// The head of a resting body is so many times as far above the hips as it is beside them.
inline constexpr double kUpClearly = 2.0;

struct BvhOptions {
  double unit_m =
      0.0;  // metres per file unit; 0 = guessed: the one of kClipUnits that kAssumedBodyHeightM suggests
  std::optional<bool>
      is_z_up{};             // else +Y is up; empty = guessed: +Z where the head is above the hips at rest
  std::string head_joint{};  // empty: "Head" or "head", with or without a prefix ending in ':' or '_'
  bool has_body = false;  // MotionClip's joints: neck, chest, shoulders and elbows, as far as names are known
  std::vector<std::string>
      body_joints{};  // these besides, by their names in the file; at most kMaxBodyJoints
  bool skip_first_frame_if_t_pose = true;
  bool recentre = true;  // subtract the first pose's horizontal position
};

/// World poses of the head joint, one per frame. The rest pose of the file (all rotations zero) is taken to
/// look along +Z when +Y is up, and along -Y when +Z is up (all known files do); it becomes the identity, +Z
/// forward, +Y up. Rotations are applied in the order of CHANNELS; a position channel on any joint replaces
/// that axis of its OFFSET. BadInput and LimitExceeded name file and line; NotFound lists the joints.
Result<MotionClip> load_bvh(const std::filesystem::path& path, const BvhOptions& options);

/// As load_bvh, from text; `place` names it in errors.
Result<MotionClip> parse_bvh(const std::string& text, const std::string& place, const BvhOptions& options);

}  // namespace strandcast
