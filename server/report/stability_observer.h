// StabilityObserver: observes a run step by step and computes the measures of stability_trial.h. Uses
// positions only, so that all models are measured alike. Any thread.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "server/report/stability_trial.h"

namespace strandcast {

/// Speed below which motion is invisible: a tenth of a millimetre, the default bound of the strand stream,
/// per sixtieth of a second.
inline constexpr double kRestingSpeedMps = 6e-3;
/// Steps over which jitter is measured, and the delay after the head has stopped.
inline constexpr int kJitterSteps = 128;
inline constexpr double kJitterDelayS = 1.0;

/// Returns the RMS acceleration (m/s^2) of `position_m`, sampled every `step_s`, in the upper half of the
/// representable frequencies: a quarter to a half of the step rate. A Hann window excludes slow swings. 0 for
/// fewer than 16 samples.
double upper_band_acceleration_mps2(const std::vector<glm::dvec3>& position_m, double step_s);

class StabilityObserver {
 public:
  StabilityObserver(const StabilityTrial& trial, const glm::dquat& world_from_head_rotation);

  /// Begins with the state from which the run starts.
  void begin(const SolverState& state);
  /// Takes the state after a step of `input.h_s` that ends at `time_s`. If states are sampled rarely, they
  /// must come in pairs of successive steps, the first by skip_to().
  void step(const SolverState& state, const StepInput& input, double time_s);
  void skip_to(const SolverState& state);

  /// Returns the values by StabilityMeasure; all are computed, whether the trial needs them or not.
  std::array<double, kStabilityMeasureCount> values(const glm::dquat& world_from_head_rotation) const;

 private:
  size_t index(uint32_t vertex, uint32_t strand) const {
    return static_cast<size_t>(vertex) * strand_count_ + strand;
  }
  void keep(const SolverState& state);
  void measure_stretch(const SolverState& state);
  void measure_motion(const SolverState& state, const StepInput& input, double time_s);
  void sample_jitter(const SolverState& state, double time_s);
  double jitter_mps2() const;
  double style_distance_m(const glm::dquat& world_from_head_rotation) const;

  const StabilityTrial& trial_;
  uint32_t strand_count_ = 0;
  uint32_t vertex_count_ = 0;
  std::vector<glm::dvec3> rest_m_;   // (vertex_count x strand_count) head space
  std::vector<double> segment_m_;    // before each vertex
  std::vector<double> unit_m_;       // what its stretch is relative to
  std::vector<double> mass_m_;       // of each vertex, over the mass per length
  double energy_scale_m3ps2_ = 0.0;  // that growth is relative to, over the mass per length
  double first_energy_m3ps2_ = 0.0;

  std::vector<glm::dvec3> previous_m_;
  std::vector<std::vector<glm::dvec3>> jitter_m_;  // per vertex and strand, kJitterSteps positions
  double jitter_step_s_ = 0.0;
  uint64_t broken_steps_ = 0;
  double largest_stretch_ = 0.0;
  double largest_speed_mps_ = 0.0;
  double largest_growth_ = 0.0;
  double moved_until_s_ = 0.0;  // after the head stopped
  double ended_s_ = 0.0;
};

}  // namespace strandcast
