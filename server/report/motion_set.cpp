#include "server/report/motion_set.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "common/base/check.h"
#include "server/scene/step_builder.h"

namespace strandcast {
namespace {

// Head and wind set in over this time.
constexpr double kRampS = 0.5;
// The built-in motion from shortly before its fast turn.
constexpr double kBuiltInBeginS = 7.3;
constexpr double kRingRadiusM = 0.1;
constexpr double kCurlTurns = 2.0;
constexpr double kCurlRadiusM = 0.01;
constexpr double kStyledArcRad = 100.0 / 180.0 * std::numbers::pi;
// A breeze from the side with gusts as strong as near the ground.
constexpr glm::vec3 kWindMps(0.9f, 0.0f, 0.5f);
constexpr float kGustIntensity = 0.4f;

/// 0 to 1 with vanishing first and second derivatives at both ends.
double eased(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * x * (x * (6.0 * x - 15.0) + 10.0);
}

/// Integral of eased(t / kRampS): a clock that starts gently.
double eased_time_s(double t_s) {
  const double x = std::clamp(t_s / kRampS, 0.0, 1.0);
  const double ramp = kRampS * x * x * x * x * (x * (x - 3.0) + 2.5);
  return ramp + std::max(0.0, t_s - kRampS);
}

/// Uniform cubic B-spline over the clip's frames: twice differentiable, unlike the samples' polyline.
Pose smooth_sample(const MotionClip& clip, double t_s) {
  const auto last = static_cast<int64_t>(clip.world_from_head.size()) - 1;
  const double frame = std::clamp(t_s / clip.frame_s, 0.0, static_cast<double>(last));
  const double whole = std::floor(frame);
  const double u = frame - whole;
  const std::array weights = {(1.0 - u) * (1.0 - u) * (1.0 - u) / 6.0,
                              (3.0 * u * u * u - 6.0 * u * u + 4.0) / 6.0,
                              (-3.0 * u * u * u + 3.0 * u * u + 3.0 * u + 1.0) / 6.0, u * u * u / 6.0};
  Pose pose;
  glm::dquat rotation(0.0, 0.0, 0.0, 0.0);
  for (size_t k = 0; k < weights.size(); ++k) {
    const int64_t index =
        std::clamp<int64_t>(static_cast<int64_t>(whole) + static_cast<int64_t>(k) - 1, 0, last);
    const Pose& key = clip.world_from_head[static_cast<size_t>(index)];
    pose.position_m += weights[k] * key.position_m;
    const double sign = glm::dot(rotation, key.rotation) < 0.0 ? -1.0 : 1.0;
    rotation = rotation + key.rotation * (sign * weights[k]);
  }
  pose.rotation = glm::normalize(rotation);
  return pose;
}

SceneDesc scene_for(const RunSetting& setting) {
  SceneDesc scene;
  scene.step_rate_hz = setting.rate_hz;
  scene.substeps = setting.substeps;
  scene.wind.mean_mps = kWindMps;
  scene.wind.gust_intensity = kGustIntensity;
  scene.has_auto_collider = false;
  scene.follicle_limit_deg = 180.0;  // models by themselves
  return scene;
}

/// Points of a curve of kLengthM from the origin, evenly along it; `out` points away from the head, level.
std::vector<glm::dvec3> curve_of(MotionHair hair, uint32_t vertex_count, const glm::dvec3& out) {
  constexpr double kLengthM = MotionSet::kLengthM;
  constexpr glm::dvec3 kUp(0.0, 1.0, 0.0);
  if (hair == MotionHair::Straight) return straight_run(vertex_count, kLengthM, -kUp);
  const glm::dvec3 aside = glm::cross(kUp, out);
  const double around_m = 2.0 * std::numbers::pi * kCurlTurns * kCurlRadiusM;
  const double sunk_m = std::sqrt(kLengthM * kLengthM - around_m * around_m);
  std::vector<glm::dvec3> curve;
  for (uint32_t i = 0; i < vertex_count; ++i) {
    const double share = static_cast<double>(i) / (vertex_count - 1);
    if (hair == MotionHair::Curled) {
      const double angle = 2.0 * std::numbers::pi * kCurlTurns * share;
      curve.push_back(kCurlRadiusM * ((1.0 - std::cos(angle)) * out + std::sin(angle) * aside) -
                      sunk_m * share * kUp);
    } else {
      const double angle = kStyledArcRad * share;
      curve.push_back(kLengthM / kStyledArcRad * (std::sin(angle) * out - (1.0 - std::cos(angle)) * kUp));
    }
  }
  return curve;
}

/// The reference's curve at a share of its arc: cubic through the four vertices around it.
glm::dvec3 point_at(const Trajectory& reference, size_t sample, uint32_t strand, double share) {
  const auto vertex = [&](int64_t i) {
    return glm::dvec3(reference.position_m[sample][static_cast<size_t>(i) * reference.strand_count + strand]);
  };
  const int64_t last = static_cast<int64_t>(reference.vertex_count) - 1;
  const double place = share * static_cast<double>(last);
  const int64_t begin =
      std::clamp<int64_t>(static_cast<int64_t>(place) - 1, 0, std::max<int64_t>(0, last - 3));
  const int64_t end = std::min(last, begin + 3);
  glm::dvec3 point(0.0);
  for (int64_t i = begin; i <= end; ++i) {
    double weight = 1.0;
    for (int64_t j = begin; j <= end; ++j)
      if (j != i) weight *= (place - static_cast<double>(j)) / static_cast<double>(i - j);
    point += weight * vertex(i);
  }
  return point;
}

}  // namespace

const char* to_string(MotionHair hair) {
  switch (hair) {
    case MotionHair::Straight:
      return "straight";
    case MotionHair::Curled:
      return "curled";
    case MotionHair::Styled:
      return "styled";
  }
  return "?";
}

Result<MotionSet> MotionSet::make(const MotionSetOptions& options) {
  MotionClip clip;
  if (!options.clip.empty()) {
    ASSIGN_OR_RETURN(MotionFile file, load_motion_file(options.clip, options.clip_file));
    for (const std::string& note : file.notes) fmt::print(stderr, "{}\n", note);
    clip = std::move(file.clip);
    if (clip.duration_s() < options.duration_s) {
      return at(options.clip.string(),
                make_error(ErrorCode::BadInput, "the motion lasts {:.2f} s (at least {:g} s are measured)",
                           clip.duration_s(), options.duration_s));
    }
  }
  return MotionSet(options, std::move(clip));
}

Groom MotionSet::groom(uint32_t vertex_count, uint32_t strand_count) const {
  std::vector<std::vector<glm::dvec3>> strands;
  for (uint32_t s = 0; s < strand_count; ++s) {
    const double angle = 2.0 * std::numbers::pi * s / strand_count;
    const glm::dvec3 out(std::cos(angle), 0.0, std::sin(angle));
    std::vector<glm::dvec3> strand = curve_of(options_.hair, vertex_count, out);
    for (glm::dvec3& point : strand) point += kRingRadiusM * out;
    strands.push_back(std::move(strand));
  }
  return groom_of(strands, Pinning::Root);
}

RunPhysics MotionSet::physics() const {
  RunPhysics physics;
  physics.length_m = kLengthM;
  // The damping is that of direct_rod's material as it ships.
  physics.given = {{"air_drag_per_s", kAirDragPerS}, {"bending_damping_s", 2e-3}};
  if (options_.hair != MotionHair::Straight) physics.given["sag_free"] = 0.0;
  return physics;
}

Pose MotionSet::clip_pose(double clip_s) const {
  return clip_.world_from_head.empty() ? built_in_motion(kBuiltInBeginS + clip_s)
                                       : smooth_sample(clip_, clip_s);
}

// The head begins upright, whatever way the clip does: the strands on it hang.
Pose MotionSet::head_at(double t_s) const {
  Pose pose = clip_pose(eased_time_s(t_s));
  pose.rotation = pose.rotation * glm::conjugate(clip_pose(0.0).rotation);
  return pose;
}

void MotionSet::for_each_step(const RunSetting& setting, int step_count,
                              const std::function<void(const std::vector<StepInput>&)>& take) const {
  const SceneDesc scene = scene_for(setting);
  const SceneFeatures features = analyse(scene, {});
  StepBuilder builder(scene, {});
  InputFrame frame;
  frame.has_motion = true;
  frame.world_from_head = head_at(0.0);
  (void)builder.build(frame, features, 0.0);  // where the head begins
  for (int step = 1; step <= step_count; ++step) {
    const double end_s = step / setting.rate_hz;
    frame.world_from_head = head_at(end_s);
    std::vector<StepInput> substeps = builder.build(frame, features, end_s).substeps;
    for (size_t i = 0; i < substeps.size(); ++i) {
      const double left = 1.0 - static_cast<double>(i + 1) / static_cast<double>(substeps.size());
      const double ramp = eased((end_s - left / setting.rate_hz) / kRampS);
      substeps[i].wind_mps *= ramp;
      for (GustWave& gust : substeps[i].gusts) gust.amplitude_mps *= static_cast<float>(ramp);
      if (options_.hair != MotionHair::Straight) substeps[i].gravity_mps2 *= ramp;
    }
    take(substeps);
  }
}

std::vector<StepInput> MotionSet::inputs(const RunSetting& setting, int step_count) const {
  std::vector<StepInput> all;
  for_each_step(setting, step_count, [&](const std::vector<StepInput>& substeps) {
    all.insert(all.end(), substeps.begin(), substeps.end());
  });
  return all;
}

Result<Trajectory> MotionSet::run(const Workbench& workbench, const RunSetting& setting,
                                  uint32_t strand_count) const {
  const Groom strands = groom(setting.vertex_count, strand_count);
  ASSIGN_OR_RETURN(StrandRun run, StrandRun::make(workbench, setting, physics(), strands));
  Trajectory trajectory;
  trajectory.strand_count = strand_count;
  trajectory.vertex_count = setting.vertex_count;
  const auto steps_per_sample = static_cast<int>(std::lround(kSampleS * setting.rate_hz));
  const auto sample_count = static_cast<int>(std::floor(options_.duration_s / kSampleS + 1e-9));
  int step = 0;
  for_each_step(setting, steps_per_sample * sample_count, [&](const std::vector<StepInput>& substeps) {
    for (const StepInput& substep : substeps) run.substep(substep);
    if (++step % steps_per_sample != 0) return;
    const SolverState& state = run.state();
    trajectory.is_finite = trajectory.is_finite && is_state_finite(state);
    trajectory.stretch = std::max(trajectory.stretch, largest_run_stretch(strands, state));
    trajectory.position_m.push_back(state.position_m);
  });
  return trajectory;
}

Result<Trajectory> run_in_double(const MotionSet& motion, const std::string& solver, uint32_t vertex_count,
                                 double rate_hz) {
  ASSIGN_OR_RETURN(const SolverRow* row, find_solver(solver));
  RunSetting setting{row, Material::Hair, vertex_count, rate_hz};
  setting.is_reference = true;
  return motion.run({}, setting);
}

Result<Trajectory> run_rod(const MotionSet& motion, uint32_t vertex_count, double rate_hz) {
  return run_in_double(motion, "direct_rod", vertex_count, rate_hz);
}

double relative_rms(const Trajectory& run, const Trajectory& reference) {
  if (!run.is_finite || !reference.is_finite) return INFINITY;
  const uint32_t strand_count = std::min(run.strand_count, reference.strand_count);
  CHECK(run.strand_count % strand_count == 0 && reference.strand_count % strand_count == 0);
  double sum = 0.0;
  for (size_t sample = 0; sample < run.position_m.size(); ++sample) {
    for (uint32_t s = 0; s < strand_count; ++s) {
      const uint32_t run_strand = s * (run.strand_count / strand_count);
      const uint32_t reference_strand = s * (reference.strand_count / strand_count);
      for (uint32_t i = 1; i < run.vertex_count; ++i) {
        const glm::dvec3 point(
            run.position_m[sample][static_cast<size_t>(i) * run.strand_count + run_strand]);
        const double share = static_cast<double>(i) / (run.vertex_count - 1);
        const glm::dvec3 off = point - point_at(reference, sample, reference_strand, share);
        sum += glm::dot(off, off);
      }
    }
  }
  const double count = static_cast<double>(run.position_m.size()) * strand_count * (run.vertex_count - 1);
  return std::sqrt(sum / count) / MotionSet::kLengthM;
}

}  // namespace strandcast
