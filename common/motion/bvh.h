// Reads head motion from BVH motion capture files. The whole hierarchy is parsed, but only the path from the
// root to the head is evaluated, in double. Input is untrusted: limits are checked before anything is
// allocated. Any thread.
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

/// Assumed size of an adult's skeleton, from its lowest to its highest joint, and of its foot.
inline constexpr double kAssumedBodyHeightM = 1.7;

/// Largest number of joints taken from a clip; a motion stream holds as many.
inline constexpr size_t kMaxBodyJoints = 12;

struct LengthUnit {
  double m = 1.0;
  const char* name = "";   // of several, as in "bones of 180 cm"
  bool is_common = false;  // taken for children too
};
/// Known units of clips. CMU's unit, 1 / 0.45 of an inch, is that of its Acclaim files; some conversions keep
/// its numbers.
inline constexpr LengthUnit kClipUnits[] = {
    {1e-3, "mm", true}, {1e-2, "cm", true}, {0.0254, "inches"}, {0.0254 / 0.45, "CMU's units"},
    {0.1, "dm"},        {0.3048, "feet"},   {1.0, "m", true}};
/// Relative distance within which a guessed unit is replaced by a known one.
inline constexpr double kUnitSnap = 0.25;

/// Height down to which a body in a common unit is a child's.
inline constexpr double kSmallestBodyM = 0.85;

/// Factor by which the resting head must be farther above the hips than beside them for an axis to count as
/// up.
inline constexpr double kUpClearly = 2.0;

struct BvhOptions {
  double unit_m =
      0.0;  // metres per file unit; 0 = guessed: the one of kClipUnits that kAssumedBodyHeightM suggests
  double frame_s = 0.0;  // of a frame, where the file does not say it; 0 = refused then
  std::optional<bool>
      is_z_up{};             // else +Y is up; empty = guessed: +Z where the head is above the hips at rest
  std::string head_joint{};  // empty: "Head" or "head", with or without a prefix ending in ':' or '_'
  bool has_body = false;  // MotionClip's joints: neck, chest, shoulders and elbows, as far as names are known
  std::vector<std::string>
      body_joints{};  // these besides, by their names in the file; at most kMaxBodyJoints
  bool skip_first_frame_if_t_pose = true;
  bool recentre = true;  // subtract the first pose's horizontal position
};

/// Loads world poses of the head joint, one per frame. Rotations are applied in the order of CHANNELS; a
/// position channel of any joint replaces that axis of its OFFSET. The rest pose (all rotations zero) looks
/// where its left and right joints say, else along +Z if +Y is up, and along -Y if +Z is up. It becomes the
/// identity: +Z forward, +Y up. The up axis of the motion may differ from that of the rest pose, and is
/// guessed by itself: where the head is above the hips. Of several performers the first with a head counts.
/// Frames that cannot be read are bridged, and there are as many as there are rows; MotionClip's repairs say
/// so. BadInput and LimitExceeded name file and line; NotFound lists the joints.
Result<MotionClip> load_bvh(const std::filesystem::path& path, const BvhOptions& options);

/// Parses BVH text like load_bvh(); `place` names it in errors.
Result<MotionClip> parse_bvh(const std::string& text, const std::string& place, const BvhOptions& options);

}  // namespace strandcast
