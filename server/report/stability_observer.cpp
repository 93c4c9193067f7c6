#include "server/report/stability_observer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace strandcast {
namespace {
constexpr size_t kFewestSamples = 16;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

bool is_finite(const std::vector<glm::vec3>& values) {
  return std::all_of(values.begin(), values.end(), [](const glm::vec3& v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
  });
}

}  // namespace

double upper_band_acceleration_mps2(const std::vector<glm::dvec3>& position_m, double step_s) {
  if (position_m.size() < kFewestSamples) return 0.0;
  const size_t count = position_m.size() - 2;
  std::vector<glm::dvec3> windowed(count);
  double window_power = 0.0;
  for (size_t i = 0; i < count; ++i) {
    const double window = 0.5 * (1.0 - std::cos(2.0 * std::numbers::pi * (static_cast<double>(i) + 0.5) /
                                                static_cast<double>(count)));
    const glm::dvec3 change = position_m[i + 2] - 2.0 * position_m[i + 1] + position_m[i];
    windowed[i] = change * (window / (step_s * step_s));
    window_power += window * window;
  }
  // Parseval over one side of the spectrum; the highest frequency has no twin.
  double power = 0.0;
  for (size_t bin = count / 4 + 1; bin <= count / 2; ++bin) {
    glm::dvec3 real(0.0), imaginary(0.0);
    for (size_t i = 0; i < count; ++i) {
      const double angle =
          2.0 * std::numbers::pi * static_cast<double>((bin * i) % count) / static_cast<double>(count);
      real += windowed[i] * std::cos(angle);
      imaginary += windowed[i] * std::sin(angle);
    }
    const double sides = 2 * bin == count ? 1.0 : 2.0;
    power += sides * (glm::dot(real, real) + glm::dot(imaginary, imaginary));
  }
  return std::sqrt(power / (static_cast<double>(count) * window_power));
}

StabilityObserver::StabilityObserver(const StabilityTrial& trial, const glm::dquat& world_from_head_rotation)
    : trial_(trial),
      strand_count_(trial.groom->strand_count()),
      vertex_count_(trial.groom->uniform_vertex_count()) {
  const size_t size = static_cast<size_t>(strand_count_) * vertex_count_;
  rest_m_.resize(size);
  segment_m_.assign(size, 0.0);
  unit_m_.assign(size, 0.0);
  mass_m_.assign(size, 0.0);
  const double gravity_mps2 = glm::length(trial.gravity_mps2);
  for (uint32_t strand = 0; strand < strand_count_; ++strand) {
    double length_m = 0.0;
    for (uint32_t i = 0; i < vertex_count_; ++i) {
      const size_t at = index(i, strand);
      rest_m_[at] = glm::dvec3(trial.groom->rest_position_m[trial.groom->offset[strand] + i]);
      if (i == 0) continue;
      segment_m_[at] = glm::distance(rest_m_[at], rest_m_[at - strand_count_]);
      length_m += segment_m_[at];
    }
    for (uint32_t i = 1; i < vertex_count_; ++i) {
      const size_t at = index(i, strand);
      unit_m_[at] = std::max(segment_m_[at], length_m / (vertex_count_ - 1));
      mass_m_[at] += 0.5 * segment_m_[at];
      mass_m_[at - strand_count_] += 0.5 * segment_m_[at];
    }
    energy_scale_m3ps2_ += gravity_mps2 * length_m * length_m;
  }
  jitter_m_.resize(size);
  previous_m_.resize(size);
  for (size_t i = 0; i < size; ++i) previous_m_[i] = world_from_head_rotation * rest_m_[i];
}

void StabilityObserver::keep(const SolverState& state) {
  for (size_t i = 0; i < previous_m_.size(); ++i) previous_m_[i] = glm::dvec3(state.position_m[i]);
}

void StabilityObserver::begin(const SolverState& state) {
  keep(state);
  double kinetic = 0.0;
  first_energy_m3ps2_ = 0.0;
  for (size_t i = 0; i < previous_m_.size(); ++i) {
    const glm::dvec3 velocity(state.velocity_mps[i]);
    kinetic += 0.5 * mass_m_[i] * glm::dot(velocity, velocity);
    first_energy_m3ps2_ -= mass_m_[i] * glm::dot(trial_.gravity_mps2, previous_m_[i]);
  }
  first_energy_m3ps2_ += kinetic;
  if (energy_scale_m3ps2_ == 0.0) energy_scale_m3ps2_ = kinetic;
}

void StabilityObserver::skip_to(const SolverState& state) {
  if (is_finite(state.position_m)) keep(state);
}

void StabilityObserver::step(const SolverState& state, const StepInput& input, double time_s) {
  ended_s_ = time_s;
  if (!is_finite(state.position_m) || !is_finite(state.velocity_mps)) {
    ++broken_steps_;
    return;
  }
  measure_stretch(state);
  measure_motion(state, input, time_s);
  sample_jitter(state, time_s);
  jitter_step_s_ = input.h_s;
  keep(state);
}

void StabilityObserver::measure_stretch(const SolverState& state) {
  for (size_t i = strand_count_; i < previous_m_.size(); ++i) {
    if (unit_m_[i] == 0.0) continue;  // a strand without length
    const double length_m =
        glm::distance(glm::dvec3(state.position_m[i]), glm::dvec3(state.position_m[i - strand_count_]));
    largest_stretch_ = std::max(largest_stretch_, std::abs(length_m - segment_m_[i]) / unit_m_[i]);
  }
}

/// Speeds are those that are seen: from where a vertex was to where it is. Energy is kinetic plus that of
/// height, half-way, which makes a free fall in symplectic Euler steps exact. What is stored in a bent strand
/// cannot be negative, so without it the sum may never exceed what a strand in its groomed shape began with.
void StabilityObserver::measure_motion(const SolverState& state, const StepInput& input, double time_s) {
  double energy = 0.0;
  double fastest_mps = 0.0;
  for (size_t i = 0; i < previous_m_.size(); ++i) {
    const glm::dvec3 now(state.position_m[i]);
    const glm::dvec3 velocity = (now - previous_m_[i]) / input.h_s;
    const double squared = glm::dot(velocity, velocity);
    fastest_mps = std::max(fastest_mps, std::sqrt(squared));
    energy += mass_m_[i] * (0.5 * squared - glm::dot(trial_.gravity_mps2, 0.5 * (now + previous_m_[i])));
  }
  largest_speed_mps_ = std::max(largest_speed_mps_, fastest_mps);
  if (fastest_mps > kRestingSpeedMps) moved_until_s_ = std::max(0.0, time_s - trial_.moving_s);
  if (energy_scale_m3ps2_ > 0.0)
    largest_growth_ = std::max(largest_growth_, (energy - first_energy_m3ps2_) / energy_scale_m3ps2_);
}

void StabilityObserver::sample_jitter(const SolverState& state, double time_s) {
  if (time_s < trial_.moving_s + kJitterDelayS || jitter_m_[0].size() >= kJitterSteps) return;
  for (size_t i = 0; i < jitter_m_.size(); ++i) jitter_m_[i].emplace_back(state.position_m[i]);
}

double StabilityObserver::jitter_mps2() const {
  double largest = 0.0;
  for (const auto& positions : jitter_m_)
    largest = std::max(largest, upper_band_acceleration_mps2(positions, jitter_step_s_));
  return largest;
}

double StabilityObserver::style_distance_m(const glm::dquat& world_from_head_rotation) const {
  double largest = 0.0;
  for (size_t i = 0; i < rest_m_.size(); ++i)
    largest = std::max(largest, glm::distance(previous_m_[i], world_from_head_rotation * rest_m_[i]));
  return largest;
}

std::array<double, kStabilityMeasureCount> StabilityObserver::values(
    const glm::dquat& world_from_head_rotation) const {
  const auto unless_broken = [this](double value) { return broken_steps_ > 0 ? kInfinity : value; };
  const bool moves_still = moved_until_s_ > 0.0 && moved_until_s_ >= ended_s_ - trial_.moving_s;
  return {static_cast<double>(broken_steps_),
          unless_broken(largest_stretch_),
          unless_broken(largest_speed_mps_),
          unless_broken(largest_growth_),
          unless_broken(moves_still ? kInfinity : moved_until_s_),
          unless_broken(jitter_mps2()),
          unless_broken(style_distance_m(world_from_head_rotation))};
}

}  // namespace strandcast
