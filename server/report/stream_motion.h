// Head motions under which the streaming report records strands: .bvh files, or three built-in ones.
// Immutable; any thread.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/math/pose.h"
#include "common/motion/motion_file.h"

namespace strandcast {

/// Time between frames of a recording: 60 frames a second.
inline constexpr double kStreamFrameS = 1.0 / 60.0;

/// How strongly a motion moves hair; it decides the motion's goals. Depends on the head alone, so that a clip
/// has the same level with every strand model.
enum class MotionLevel { Idle, Active, Violent };
/// Returns "idle", "walking and turning" or "violent".
const char* to_string(MotionLevel motion_level);

/// Parts of a motion that are recorded: a typical one and the wildest.
enum class MotionPart { Median, Wildest };
inline constexpr MotionPart kMotionParts[] = {MotionPart::Median, MotionPart::Wildest};
/// Returns "median" or "wildest".
const char* to_string(MotionPart part);

struct HeadPace {
  double mean_speed_mps = 0.0;  // of the head joint
  double mean_turn_rad_per_s = 0.0;
};
HeadPace measure_pace(const std::vector<Pose>& world_from_head, double frame_s);

struct StreamMotion {
  std::string name;
  std::function<Pose(double)> head_at;  // s from its beginning
  double duration_s = 0.0;              // infinite for a built-in one
};

/// Summary of a motion. The *drive* of a part estimates how fast its head makes hair move. It combines the
/// mean rate of rotation, at the length of a hair, with the mean acceleration while hair follows.
struct MotionSurvey {
  MotionLevel level = MotionLevel::Idle;  // by the median drive of all half seconds
  double median_drive_mps = 0.0;
  double begin_s[2] = {0.0, 0.0};  // of each of kMotionParts
};
inline constexpr double kSurveyPartS = 0.5;
// Drive of a head: by its turns at this length, and by its accelerations for this long.
inline constexpr double kDriveLengthM = 0.25;
inline constexpr double kDriveLagS = 0.03;
/// Drives at which the levels begin. Standing has 0.02 m/s, known clips of walking and dancing 0.22 to 0.46,
/// salsa and spins 0.76 to 0.93.
inline constexpr double kActiveDriveMps = 0.1;
inline constexpr double kViolentDriveMps = 0.6;
/// Examines all parts of `seconds`, one frame apart; for a motion without end, those in its first seconds.
MotionSurvey survey_motion(const StreamMotion& motion, double seconds);

/// Returns the built-in motions idle, active and violent.
std::vector<StreamMotion> built_in_stream_motions();
/// Captured head motions that the report uses if they are available, by purpose.
struct StreamClip {
  const char* character;                // "walking", "wild", "glitching"
  std::vector<const char*> file_names;  // the first that is there
};
const std::vector<StreamClip>& stream_clips();
struct FoundClips {
  std::vector<StreamMotion> motions;
  std::vector<std::string> notes;  // a sentence for each clip, found or missing
};
/// Finds the clips in a folder, which need not exist.
Result<FoundClips> find_stream_clips(const std::filesystem::path& folder, const MotionFileOptions& options);
/// Loads a motion; prints the assumptions about the file to standard error.
Result<StreamMotion> load_stream_motion(const std::filesystem::path& path, const MotionFileOptions& options);

}  // namespace strandcast
