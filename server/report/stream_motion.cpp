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

MotionLevel motion_level_of(double hair_rms_mps) {
  if (hair_rms_mps < kActiveHairMps) return MotionLevel::Idle;
  return hair_rms_mps < kViolentHairMps ? MotionLevel::Active : MotionLevel::Violent;
}

HeadMeasure measure_head(const std::vector<Pose>& world_from_head, double frame_s) {
  CHECK(frame_s > 0.0);
  HeadMeasure measure;
  const double total_s = frame_s * (static_cast<double>(world_from_head.size()) - 1.0);
  for (size_t i = 1; i < world_from_head.size(); ++i) {
    const Pose& before = world_from_head[i - 1];
    const Pose& now = world_from_head[i];
    measure.mean_speed_mps += glm::distance(before.position_m, now.position_m) / total_s;
    measure.mean_turn_rad_per_s += angle_between_rad(before.rotation, now.rotation) / total_s;
  }
  return measure;
}

std::vector<StreamMotion> built_in_stream_motions() {
  constexpr double kEndless = std::numeric_limits<double>::infinity();
  return {{"built-in idle", idle_head, kEndless},
          {"built-in walk", [](double t_s) { return built_in_motion(kWalkBeginS + t_s); }, kEndless},
          {"built-in violent", violent_head, kEndless}};
}

Result<StreamMotion> load_stream_motion(const std::filesystem::path& path, const MotionFileOptions& options) {
  ASSIGN_OR_RETURN(MotionFile file, load_motion_file(path, options));
  for (const std::string& note : file.notes) fmt::print(stderr, "{}\n", note);
  const auto clip = std::make_shared<const MotionClip>(std::move(file.clip));
  return StreamMotion{path.stem().string(), [clip](double t_s) { return clip->sample(t_s); },
                      clip->duration_s()};
}

}  // namespace strandcast
