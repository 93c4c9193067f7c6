// Head motions that the streaming report records strands under: .bvh files, or three built in. Immutable; any
// thread.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/math/pose.h"
#include "common/motion/motion_file.h"

namespace strandcast {

/// Recordings have 60 frames a second.
inline constexpr double kStreamFrameS = 1.0 / 60.0;

/// How much a motion asks of hair; decides which goals it is held to. By the head alone, so that a clip is
/// the same with every strand model.
enum class MotionLevel { Idle, Active, Violent };
/// "idle", "walking and turning", "violent".
const char* to_string(MotionLevel motion_level);

/// The parts of a motion that are recorded: what it mostly is, and its worst.
enum class MotionPart { Median, Wildest };
inline constexpr MotionPart kMotionParts[] = {MotionPart::Median, MotionPart::Wildest};
/// "median", "wildest".
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

/// A motion as a whole. The *drive* of a part is about how fast its head makes hair move: its mean rate of
/// turn at the length of a hair, and its mean acceleration during the time in which hair follows.
struct MotionSurvey {
  MotionLevel level = MotionLevel::Idle;  // by the median drive of all half seconds
  double median_drive_mps = 0.0;
  double begin_s[2] = {0.0, 0.0};  // of each of kMotionParts
};
inline constexpr double kSurveyPartS = 0.5;
// Drive of a head: by its turns at this length, and by its accelerations for this long.
inline constexpr double kDriveLengthM = 0.25;
inline constexpr double kDriveLagS = 0.03;
/// Standing has 0.02 m/s, walking and dancing at hand 0.22 to 0.46, salsa and spins 0.76 to 0.93.
inline constexpr double kActiveDriveMps = 0.1;
inline constexpr double kViolentDriveMps = 0.6;
/// Looks at all parts of `seconds`, one frame apart; of a motion without end at those in its first seconds.
MotionSurvey survey_motion(const StreamMotion& motion, double seconds);

/// idle, active and violent, built in.
std::vector<StreamMotion> built_in_stream_motions();
/// Captured heads that the report takes where they are at hand, by what they are for.
struct StreamClip {
  const char* character;                // "walking", "wild", "glitching"
  std::vector<const char*> file_names;  // the first that is there
};
const std::vector<StreamClip>& stream_clips();
struct FoundClips {
  std::vector<StreamMotion> motions;
  std::vector<std::string> notes;  // a sentence for each clip, found or missing
};
/// From a folder that need not exist.
Result<FoundClips> find_stream_clips(const std::filesystem::path& folder, const MotionFileOptions& options);
/// What was assumed about the file is said on standard error.
Result<StreamMotion> load_stream_motion(const std::filesystem::path& path, const MotionFileOptions& options);

}  // namespace strandcast
