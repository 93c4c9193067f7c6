#include "server/report/stream_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>

#include "common/base/check.h"

namespace strandcast {
namespace {

/// Of motions without end; the built-in one's fast turn comes later.
constexpr double kSurveyedBuiltInS = 6.0;

// The built-in motion where it walks and looks around, before its fast turn.
constexpr double kWalkBeginS = 0.5;

// Standing: slow sways of body and head.
constexpr double kIdleSwayM = 0.01, kIdleSwayRadPerS = 0.8;
constexpr double kIdleYawRad = 0.05, kIdleYawRadPerS = 1.3;
constexpr double kIdlePitchRad = 0.03, kIdlePitchRadPerS = 0.9;

// Running, the head thrown from side to side.
constexpr double kRunMps = 3.0, kRunBobM = 0.05, kRunBobRadPerS = 17.0;
constexpr double kShakeRad = 1.3, kShakeS = 0.3, kShakePeriodS = 0.7;
constexpr double kNodRad = 0.6, kNodS = 0.35, kNodPeriodS = 0.9;
constexpr double kTargetTurn = 2.4;  // rad of a sine from one target to the next: never the same twice

/// Moves of minimum jerk between targets in -1..1, one every period.
double thrown(double t_s, double move_s, double period_s) {
  const double cycle = std::floor(t_s / period_s);
  const double x = std::min(1.0, (t_s - cycle * period_s) / move_s);
  const double from = std::sin(kTargetTurn * cycle);
  const double to = std::sin(kTargetTurn * (cycle + 1.0));
  return from + (to - from) * x * x * x * (10.0 + x * (6.0 * x - 15.0));
}

glm::dquat turned(double yaw_rad, double pitch_rad) {
  return glm::angleAxis(yaw_rad, glm::dvec3(0.0, 1.0, 0.0)) *
         glm::angleAxis(pitch_rad, glm::dvec3(1.0, 0.0, 0.0));
}

Pose idle_head(double t_s) {
  return {glm::dvec3(kIdleSwayM * std::sin(kIdleSwayRadPerS * t_s), 0.0, 0.0),
          turned(kIdleYawRad * std::sin(kIdleYawRadPerS * t_s),
                 kIdlePitchRad * std::sin(kIdlePitchRadPerS * t_s))};
}

Pose violent_head(double t_s) {
  return {glm::dvec3(0.0, kRunBobM * std::sin(kRunBobRadPerS * t_s), kRunMps * t_s),
          turned(kShakeRad * thrown(t_s, kShakeS, kShakePeriodS), kNodRad * thrown(t_s, kNodS, kNodPeriodS))};
}

}  // namespace

const char* to_string(MotionLevel motion_level) {
  switch (motion_level) {
    case MotionLevel::Idle:
      return "idle";
    case MotionLevel::Active:
      return "walking and turning";
    case MotionLevel::Violent:
      return "violent";
  }
  return "";
}

const char* to_string(MotionPart part) {
  return part == MotionPart::Median ? "median" : "wildest";
}

HeadPace measure_pace(const std::vector<Pose>& world_from_head, double frame_s) {
  CHECK(frame_s > 0.0);
  HeadPace measure;
  const double total_s = frame_s * (static_cast<double>(world_from_head.size()) - 1.0);
  for (size_t i = 1; i < world_from_head.size(); ++i) {
    const Pose& before = world_from_head[i - 1];
    const Pose& now = world_from_head[i];
    measure.mean_speed_mps += glm::distance(before.position_m, now.position_m) / total_s;
    measure.mean_turn_rad_per_s += angle_between_rad(before.rotation, now.rotation) / total_s;
  }
  return measure;
}

namespace {

/// Speed at which each frame's movement of the head drives hair.
std::vector<double> frame_drives_mps(const StreamMotion& motion) {
  const double length_s = std::isinf(motion.duration_s) ? kSurveyedBuiltInS : motion.duration_s;
  const auto count = static_cast<int>(std::floor(length_s / kStreamFrameS + 1e-6)) + 1;
  std::vector<Pose> poses;
  for (int i = 0; i < count; ++i) poses.push_back(motion.head_at(i * kStreamFrameS));
  std::vector<double> drives;
  for (size_t i = 2; i < poses.size(); ++i) {
    const double turn_rad_per_s = angle_between_rad(poses[i - 1].rotation, poses[i].rotation) / kStreamFrameS;
    const glm::dvec3 change = poses[i].position_m - 2.0 * poses[i - 1].position_m + poses[i - 2].position_m;
    const double acceleration_mps2 = glm::length(change) / (kStreamFrameS * kStreamFrameS);
    drives.push_back(kDriveLengthM * turn_rad_per_s + kDriveLagS * acceleration_mps2);
  }
  return drives;
}

struct Part {
  double drive_mps = 0.0;
  size_t first_frame = 0;
};

/// All parts of so many seconds, the tamest first. At least one.
std::vector<Part> parts_of(const std::vector<double>& drives_mps, double seconds) {
  const auto length = std::clamp<size_t>(static_cast<size_t>(std::lround(seconds / kStreamFrameS)), 1,
                                         std::max<size_t>(1, drives_mps.size()));
  std::vector<Part> parts;
  double sum_mps = 0.0;
  for (size_t i = 0; i < drives_mps.size(); ++i) {
    sum_mps += drives_mps[i];
    if (i >= length) sum_mps -= drives_mps[i - length];
    if (i + 1 >= length) parts.push_back({sum_mps / static_cast<double>(length), i + 1 - length});
  }
  if (parts.empty()) parts.push_back({});
  std::stable_sort(parts.begin(), parts.end(),
                   [](const Part& a, const Part& b) { return a.drive_mps < b.drive_mps; });
  return parts;
}

}  // namespace

MotionSurvey survey_motion(const StreamMotion& motion, double seconds) {
  const std::vector<double> drives_mps = frame_drives_mps(motion);
  const std::vector<Part> halves = parts_of(drives_mps, kSurveyPartS);
  MotionSurvey survey;
  survey.median_drive_mps = halves[halves.size() / 2].drive_mps;
  if (survey.median_drive_mps >= kActiveDriveMps) survey.level = MotionLevel::Active;
  if (survey.median_drive_mps >= kViolentDriveMps) survey.level = MotionLevel::Violent;
  const std::vector<Part> parts = parts_of(drives_mps, seconds);
  survey.begin_s[0] = static_cast<double>(parts[parts.size() / 2].first_frame) * kStreamFrameS;
  survey.begin_s[1] = static_cast<double>(parts.back().first_frame) * kStreamFrameS;
  return survey;
}

std::vector<StreamMotion> built_in_stream_motions() {
  constexpr double kEndless = std::numeric_limits<double>::infinity();
  return {{"built-in idle", idle_head, kEndless},
          {"built-in walk", [](double t_s) { return built_in_motion(kWalkBeginS + t_s); }, kEndless},
          {"built-in violent", violent_head, kEndless}};
}

const std::vector<StreamClip>& stream_clips() {
  static const std::vector<StreamClip> kClips = {
      {"walking", {"cmu_131_03.bvh"}},
      // A salsa with spins.
      {"wild", {"cmu_61_12.bvh", "61_12.bvh", "cmu_61_05_scaled.bvh"}},
      // By a camera: the head jitters from frame to frame.
      {"glitching", {"fair1_dab.bvh"}}};
  return kClips;
}

Result<FoundClips> find_stream_clips(const std::filesystem::path& folder, const MotionFileOptions& options) {
  FoundClips found;
  for (const StreamClip& clip : stream_clips()) {
    const auto name =
        std::find_if(clip.file_names.begin(), clip.file_names.end(), [&](const char* file_name) {
          std::error_code error;
          return std::filesystem::is_regular_file(folder / file_name, error);
        });
    if (name == clip.file_names.end()) {
      found.notes.push_back(
          fmt::format("No {} clip: {} is not there.", clip.character, clip.file_names.front()));
      continue;
    }
    ASSIGN_OR_RETURN(StreamMotion motion, load_stream_motion(folder / *name, options));
    found.notes.push_back(fmt::format("The {} clip is {}.", clip.character, motion.name));
    found.motions.push_back(std::move(motion));
  }
  return found;
}

Result<StreamMotion> load_stream_motion(const std::filesystem::path& path, const MotionFileOptions& options) {
  ASSIGN_OR_RETURN(MotionFile file, load_motion_file(path, options));
  for (const std::string& note : file.notes) fmt::print(stderr, "{}\n", note);
  const auto clip = std::make_shared<const MotionClip>(std::move(file.clip));
  return StreamMotion{path.stem().string(), [clip](double t_s) { return clip->sample(t_s); },
                      clip->duration_s()};
}

}  // namespace strandcast
