#include "common/motion/motion_clip.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>

#include "common/base/hash.h"

namespace strandcast {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;

/// 0 before `begin`, 1 after `end`, between them a quintic with no slope and no curvature at either end.
double ease(double begin, double end, double t) {
  const double x = std::clamp((t - begin) / (end - begin), 0.0, 1.0);
  return x * x * x * (10.0 + x * (6.0 * x - 15.0));
}

/// 1 inside, 0 outside, eased over the two ramps.
double window(double begin, double full, double fade, double end, double t) {
  return ease(begin, full, t) - ease(fade, end, t);
}

// Built-in motion. All frequencies are whole numbers of cycles per period, so that it repeats without a seam.
constexpr double kHeadHeightM = 1.6;
constexpr double kStepHz = 2.0, kBobM = 0.02, kSwayM = 0.018, kWanderM = 0.25;
constexpr double kLookHz = 4.0 / kBuiltInMotionPeriodS, kLookRad = 0.7;
constexpr double kNodHz = 15.0 / kBuiltInMotionPeriodS, kNodRad = 0.3;
constexpr double kTiltHz = 3.0 / kBuiltInMotionPeriodS, kTiltRad = 0.06;
constexpr double kTurnRad = 1.1;  // to one side; the fast turn is twice that
constexpr double kFastTurnS = 0.35;

// Turbulence: frequencies relative to mean speed / integral length, up to what a 60 Hz simulation can follow.
constexpr int kHarmonicCount = 72;
constexpr double kLowestFrequency = 0.01;
constexpr double kHighestFrequency = 40.0;
constexpr double kHighestFrequencyHz = 12.0;
constexpr double kVonKarman = 70.8;  // S(f) = 4 s^2 T / (1 + 70.8 (f T)^2)^(5/6), T = length / speed
constexpr double kSidewaysIntensity = 0.8, kAcrossIntensity = 0.5;

/// Unit vectors along the wind, sideways (horizontal) and across both.
std::array<glm::dvec3, 3> wind_axes(const glm::dvec3& mean_mps) {
  const glm::dvec3 along = glm::normalize(mean_mps);
  const glm::dvec3 helper = std::abs(along.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(1, 0, 0);
  const glm::dvec3 sideways = glm::normalize(glm::cross(helper, along));
  return {along, sideways, glm::cross(along, sideways)};
}

}  // namespace

double MotionClip::duration_s() const {
  return world_from_head.empty() ? 0.0 : frame_s * static_cast<double>(world_from_head.size() - 1);
}

Pose MotionClip::sample(double t_s) const {
  if (world_from_head.empty()) return {};
  const double frame = t_s / frame_s;
  if (!(frame > 0.0)) return world_from_head.front();
  const double last = static_cast<double>(world_from_head.size() - 1);
  if (frame >= last) return world_from_head.back();
  const auto index = static_cast<size_t>(frame);
  return interpolate(world_from_head[index], world_from_head[index + 1], frame - std::floor(frame));
}

std::vector<glm::dvec3> MotionClip::sample_joints(double t_s) const {
  std::vector<glm::dvec3> places(joint_name.size());
  if (joint_m.empty()) return {};
  const size_t last = world_from_head.size() - 1;
  const double frame = std::clamp(t_s / frame_s, 0.0, static_cast<double>(last));
  const auto index = std::min(static_cast<size_t>(frame), last);
  const size_t next = std::min(index + 1, last);
  for (size_t i = 0; i < places.size(); ++i)
    places[i] = glm::mix(joint_m[index * places.size() + i], joint_m[next * places.size() + i],
                         frame - static_cast<double>(index));
  return places;
}

double WindSeries::duration_s() const {
  return time_s.empty() ? 0.0 : time_s.back();
}

glm::vec3 WindSeries::sample(double t_s) const {
  if (time_s.empty()) return glm::vec3(0.0f);
  if (!(t_s > time_s.front())) return velocity_mps.front();
  if (t_s >= time_s.back()) return velocity_mps.back();
  const auto next = static_cast<size_t>(std::upper_bound(time_s.begin(), time_s.end(), t_s) - time_s.begin());
  const double blend = (t_s - time_s[next - 1]) / (time_s[next] - time_s[next - 1]);
  return glm::mix(velocity_mps[next - 1], velocity_mps[next], static_cast<float>(blend));
}

Pose built_in_motion(double t_s) {
  const double t = t_s - kBuiltInMotionPeriodS * std::floor(t_s / kBuiltInMotionPeriodS);
  const double turn_s = 8.0;
  const double look = kLookRad * std::sin(kTwoPi * kLookHz * t) * window(0.2, 1.2, 5.0, 6.2, t);
  const double turn = kTurnRad * (ease(6.6, turn_s - 0.2, t) - 2.0 * ease(turn_s, turn_s + kFastTurnS, t) +
                                  ease(9.2, 10.6, t));
  const double nod = kNodRad * std::sin(kTwoPi * kNodHz * t) * window(9.4, 10.0, 11.2, 11.9, t);
  const double tilt = kTiltRad * std::sin(kTwoPi * kTiltHz * t);

  Pose pose;
  pose.position_m.x = kSwayM * std::sin(kTwoPi * 0.5 * kStepHz * t);
  pose.position_m.y = kHeadHeightM + kBobM * std::sin(kTwoPi * kStepHz * t);
  pose.position_m.z = kWanderM * std::sin(kTwoPi * t / kBuiltInMotionPeriodS);
  pose.rotation = glm::angleAxis(look + turn, glm::dvec3(0, 1, 0)) *
                  glm::angleAxis(nod, glm::dvec3(1, 0, 0)) * glm::angleAxis(tilt, glm::dvec3(0, 0, 1));
  return pose;
}

GustGenerator::GustGenerator(const glm::vec3& mean_mps, float intensity, float length_m, uint32_t seed)
    : mean_mps_(mean_mps) {
  const double speed_mps = glm::length(mean_mps_);
  if (speed_mps <= 0.0 || intensity <= 0.0f || length_m <= 0.0f) return;
  const double time_scale_s = length_m / speed_mps;
  const double lowest_hz = kLowestFrequency / time_scale_s;
  const double highest_hz =
      std::max(2.0 * lowest_hz, std::min(kHighestFrequency / time_scale_s, kHighestFrequencyHz));
  const double ratio = std::pow(highest_hz / lowest_hz, 1.0 / kHarmonicCount);
  const std::array<glm::dvec3, 3> axes = wind_axes(mean_mps_);
  const std::array<double, 3> axis_intensity{1.0, kSidewaysIntensity, kAcrossIntensity};

  double variance = 0.0;  // of the sum, before scaling it to the wanted one
  uint32_t counter = mix_u32(seed ^ 0x9e3779b9u);
  const auto random_unit = [&] { return static_cast<double>(unit_float(mix_u32(counter++))); };
  for (int k = 0; k < kHarmonicCount; ++k) {
    const double begin_hz = lowest_hz * std::pow(ratio, k);
    // A random place in its band keeps the harmonics from ever falling into step.
    const double f_hz = begin_hz * std::pow(ratio, random_unit());
    const double x = f_hz * time_scale_s;
    const double density = 4.0 * time_scale_s / std::pow(1.0 + kVonKarman * x * x, 5.0 / 6.0);
    const double amplitude = std::sqrt(2.0 * density * begin_hz * (ratio - 1.0));
    variance += 0.5 * amplitude * amplitude;

    // Sinusoids along the three wind axes add up to one sinusoid per world axis.
    std::array<std::complex<double>, 3> phasor{};
    for (size_t d = 0; d < 3; ++d) {
      const auto wave = std::polar(amplitude * axis_intensity[d], kTwoPi * random_unit());
      for (int axis = 0; axis < 3; ++axis) phasor[static_cast<size_t>(axis)] += axes[d][axis] * wave;
    }
    Harmonic harmonic{glm::dvec3(0.0), kTwoPi * f_hz, glm::dvec3(0.0)};
    for (int axis = 0; axis < 3; ++axis) {
      harmonic.amplitude_mps[axis] = std::abs(phasor[static_cast<size_t>(axis)]);
      harmonic.phase_rad[axis] = std::arg(phasor[static_cast<size_t>(axis)]);
    }
    harmonics_.push_back(harmonic);
  }
  const double scale = intensity * speed_mps / std::sqrt(variance);
  for (Harmonic& harmonic : harmonics_) harmonic.amplitude_mps *= scale;
}

glm::vec3 GustGenerator::sample(double t_s) const {
  glm::dvec3 wind_mps = mean_mps_;
  for (const Harmonic& harmonic : harmonics_)
    wind_mps +=
        harmonic.amplitude_mps * glm::cos(glm::dvec3(harmonic.omega_rad_per_s * t_s) + harmonic.phase_rad);
  return wind_mps;
}

}  // namespace strandcast
