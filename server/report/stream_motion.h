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

/// How much hair moves; decides which goals a recording is held to.
enum class MotionLevel { Idle, Active, Violent };
/// "idle", "walking and turning", "violent".
const char* to_string(MotionLevel motion_level);

/// By the root of the mean square speed of all vertices in head space. Standing has about 0.02 m/s, recorded
/// and built-in walking 0.07 to 0.45, jumps, spins and salsa 0.56 to 1.2.
MotionLevel motion_level_of(double hair_rms_mps);
inline constexpr double kActiveHairMps = 0.04;
inline constexpr double kViolentHairMps = 0.5;

struct HeadMeasure {
  double mean_speed_mps = 0.0;  // of the head joint
  double mean_turn_rad_per_s = 0.0;
};
HeadMeasure measure_head(const std::vector<Pose>& world_from_head, double frame_s);

struct StreamMotion {
  std::string name;
  std::function<Pose(double)> head_at;  // s from its beginning
  double duration_s = 0.0;              // infinite for a built-in one
};

/// idle, active and violent, built in.
std::vector<StreamMotion> built_in_stream_motions();
/// What was assumed about the file is said on standard error.
Result<StreamMotion> load_stream_motion(const std::filesystem::path& path, const MotionFileOptions& options);

}  // namespace strandcast
