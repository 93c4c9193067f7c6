#include "common/motion/motion_file.h"

#include "common/base/units.h"
#include "common/motion/motion_glitches.h"

namespace strandcast {
namespace {

std::string glitch_note(const MotionGlitches& glitches) {
  return fmt::format(
      "the head makes {} step{} faster than any head moves ({:g} m/s, {:g} degrees/s), the first at {:.2f} "
      "s; the "
      "fastest have {:.0f} m/s and {:.0f} degrees/s",
      glitches.step_count, glitches.step_count == 1 ? "" : "s", kMaxHeadMps, kMaxHeadDegPerS,
      glitches.first_s, glitches.fastest_mps, glitches.fastest_deg_per_s);
}

/// A clip begins above the origin, as load_bvh() leaves it.
void recentre(MotionClip& clip) {
  const glm::dvec3 start_m = clip.world_from_head.front().position_m * glm::dvec3(1, 0, 1);
  for (Pose& pose : clip.world_from_head) pose.position_m -= start_m;
}

void note(MotionFile& file, const std::string& name, const std::string& sentence) {
  file.notes.push_back(fmt::format("{}: {}", name, sentence));
}

void doubt(MotionFile& file, const std::string& name, const std::string& sentence) {
  note(file, name, sentence);
  file.unlikely.push_back(file.notes.back());
}

}  // namespace

uint32_t judge_frames(MotionFile& file, const std::string& name, const MotionFileOptions& options) {
  FirstFrames first = find_first_frames(file.clip);
  if (options.is_keeping_first_frames) first.count = 0;
  if (first.count > 0) {
    leave_out_first_frames(file.clip, first.count);
    note(file, name,
         fmt::format("{} of its frames left out at the beginning: the head jumps from there by up to {:.0f} "
                     "mm and {:.1f} degrees in a frame, as it does not afterwards (--keep-first-frames "
                     "keeps them)",
                     first.count, kMmPerM * first.jump_m, first.jump_deg));
  }
  const MotionGlitches glitches = find_glitches(file.clip);
  if (glitches.step_count == 0) return first.count;
  if (options.is_filtering_glitches)
    note(file, name,
         fmt::format("{}: {} frames replaced by what lies between the others", glitch_note(glitches),
                     filter_glitches(file.clip)));
  else if (!file.clip.unit_doubt.empty())
    doubt(file, name, fmt::format("{} (is {}unit right?)", glitch_note(glitches), options.prefix));
  else
    doubt(file, name, glitch_note(glitches) + " (--filter-glitches takes them out)");
  return first.count;
}

Result<MotionFile> load_motion_file(const std::filesystem::path& path, const MotionFileOptions& options) {
  if (!options.up.empty() && options.up != "y" && options.up != "z")
    return make_error(ErrorCode::BadInput, "unknown up axis '{}' (known: y, z)", options.up);
  BvhOptions bvh;
  bvh.unit_m = options.unit_m;
  if (!options.up.empty()) bvh.is_z_up = options.up == "z";
  bvh.head_joint = options.joint;
  if (options.fps > 0.0) bvh.frame_s = 1.0 / options.fps;
  bvh.has_body = options.has_body;
  bvh.body_joints = options.body_joints;
  bvh.skip_first_frame_if_t_pose = false;  // judged below, with all other first frames
  MotionFile file;
  ASSIGN_OR_RETURN(file.clip, load_bvh(path, bvh));
  const std::string name = path.string();
  note(file, name, file.clip.head_reason);
  for (const std::string& repair : file.clip.repairs) note(file, name, repair);
  const std::string up = " (" + options.prefix + "up", unit = " (" + options.prefix + "unit";
  if (!file.clip.up_reason.empty()) note(file, name, file.clip.up_reason + up + " states another)");
  if (!file.clip.facing_reason.empty()) note(file, name, file.clip.facing_reason);
  if (!file.clip.unit_reason.empty()) note(file, name, file.clip.unit_reason + unit + " states another)");
  if (!file.clip.up_doubt.empty()) doubt(file, name, file.clip.up_doubt + up + ")");
  if (!file.clip.unit_doubt.empty()) doubt(file, name, file.clip.unit_doubt + unit + ")");
  if (judge_frames(file, name, options) > 0) recentre(file.clip);
  return file;
}

}  // namespace strandcast
