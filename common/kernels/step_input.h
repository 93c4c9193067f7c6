// StepInput: what one substep of a strand model needs from outside, and the limits that every model puts on
// it. Plain data, any thread.
//
// Frame of the state: world axes with the origin at the head joint of the current step ("head-relative"). It
// keeps float precision anywhere in the world; each step the origin moves by head_shift_m.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <numbers>
#include <vector>

#include "common/kernels/body_input.h"
#include "common/math/bust.h"
#include "common/math/sphere_collider.h"
#include "shaders/shared/limits.h"

namespace strandcast {

/// A travelling wave of the gust field: velocity += amplitude * sin(dot(wave_vector, x) - phase).
struct GustWave {
  glm::vec3 amplitude_mps{0.0f};
  glm::vec3 wave_vector_rad_per_m{0.0f};
  float phase_rad = 0.0f;

  bool operator==(const GustWave&) const = default;
};
inline constexpr uint32_t kMaxGustWaves = 8;

/// The bust during a substep. Colliders are where it has them; what slides on its skin goes along with it.
struct BustInput {
  BustRig rig;
  BustTurn turn{0.0}, turn_before{0.0};  // at the substep's end and beginning

  bool operator==(const BustInput&) const = default;
};

/// No angle of a root is larger.
inline constexpr double kFreeFollicleRad = std::numbers::pi;

/// Everything one substep needs, at its end time.
struct StepInput {
  double h_s = 1.0 / 60.0;                                  // substep
  glm::dquat world_from_head_rotation{1.0, 0.0, 0.0, 0.0};  // at the end of the substep
  glm::dvec3 head_shift_m{0.0};  // movement of the head joint during the substep, world
  glm::dvec3 gravity_mps2{0.0, -9.81, 0.0};
  /// Gravity under which the groom has its shape, in head space: what a solver with a sag-free groom lets the
  /// pull to the groomed shape carry. Zero: the groom is the shape without gravity.
  glm::dvec3 groom_gravity_in_head_mps2{0.0};
  glm::dvec3 wind_mps{0.0};     // mean wind at the head, world
  std::vector<GustWave> gusts;  // at most kMaxGustWaves; x is relative to the head joint
  /// Most that the first free segment leans from its groomed direction, turned with the head; pi = free.
  double follicle_limit_rad = kFreeFollicleRad;
  bool renews_volume = true;              // the volume of the hair is made anew before this substep
  std::vector<SphereCollider> colliders;  // centres in head-relative world axes, at the end of the substep
  BodyInput body;                         // head space
  BustInput bust;                         // head space
};

/// Whether the volume is made anew before substep `index` of `count` in a step of `step_s`: before the first,
/// and often enough that in a longer step no volume is older than a 60th of a second by more than half.
inline bool renews_volume(size_t index, size_t count, double step_s) {
  constexpr double kVolumesPerS = 60.0;
  const auto most = static_cast<double>(count);
  const auto volumes = static_cast<size_t>(std::clamp(std::round(step_s * kVolumesPerS), 1.0, most));
  return index == 0 || index * volumes / count != (index - 1) * volumes / count;
}

/// Whether roots are held in this substep; no number, and no angle, is no limit.
inline bool has_follicle_limit(const StepInput& input) {
  return input.follicle_limit_rad >= 0.0 && input.follicle_limit_rad < kFreeFollicleRad;
}

// Bounds on what a step may ask for. Far outside anything physical; they keep squares of floats finite.
inline constexpr double kMaxSubstepS = 0.1;
inline constexpr double kMinSubstepS = 1e-6;
inline constexpr double kMaxHeadShiftM = 1e4;
inline constexpr double kMaxGravityMps2 = 1e5;
inline constexpr double kMaxWindMps = 1e4;
inline constexpr double kMaxColliderM = 1e4;  // |centre| and radius
inline constexpr double kMaxPhaseRad = 1e6;   // phases and wave numbers of gusts

/// The value within [-bound, bound]; 0 for NaN.
inline double limited(double value, double bound) {
  if (std::isnan(value)) return 0.0;
  return std::fmin(std::fmax(value, -bound), bound);
}
inline glm::dvec3 limited(const glm::dvec3& value, double bound) {
  return {limited(value.x, bound), limited(value.y, bound), limited(value.z, bound)};
}

/// The input's substep within its bounds; kMinSubstepS for NaN and non-positive values.
double limited_substep_s(const StepInput& input);

/// Unit quaternion; the identity for a zero or non-finite one.
glm::dquat limited_rotation(const glm::dquat& rotation);

struct HeadPath;

/// Pull to the groomed shape from which on it carries the whole weight of a sag-free groom; a weaker pull
/// carries its share, so a limp strand falls. At this pull a strand that sags would give way by half a metre.
inline constexpr double kSupportStiffnessPerS2 = 20.0;

/// Time by which the pull to the groomed shape looks ahead, s. Backward Euler looks a substep ahead and so
/// brakes what swings by half of that per second. With this time substeps brake alike, as those of a 60th of
/// a second do, up to twice as long; longer ones brake as much more as stays stable at any stiffness.
inline double pull_ahead_s(double substep_s) {
  constexpr double kBrakingS = 1.0 / 60.0;
  return std::max(kBrakingS, 0.5 * substep_s);
}

struct StrandParameters {
  double s_damping = 0.0;               // share of the velocity correction, 0..1
  double air_drag_per_s = 0.0;          // rate at which a strand takes on the air's velocity
  double style_stiffness_per_s2 = 0.0;  // pull to the groomed shape at the root
  double style_tip_share = 0.0;         // of that pull, what is left at the tip
  double sag_free = 0.0;                // share of the groom's gravity that the pull carries, 0..1
  double collider_friction = 0.0;       // Coulomb coefficient
  double max_speed_mps = 0.0;           // relative to the head
  double thrust_share = 1.0;            // share of the velocity correction kept when it is a thrust, 0..1
  double thickness_spread = 0.0;        // largest relative difference of a strand's thickness from the mean
};

/// Sizes of the strands that a step is for.
struct StrandCounts {
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;       // per strand
  uint32_t pinned_root_count = 0;  // leading vertices that follow the head, at least 1
  uint32_t tail_begin = 0;         // first vertex of the pinned tail, vertex_count when the tip is free
};

struct StepBlock {
  std::array<glm::vec4, 3> world_from_head;
  std::array<glm::vec4, 3> carry;
  glm::vec4 head_velocity;
  glm::vec4 push;
  glm::vec4 support;
  glm::vec4 style;
  glm::vec4 contact;
  glm::uvec4 shape;
  uint32_t step_index;
  float follicle_cosine;
  float follicle_sine;
  uint32_t unused;
  std::array<glm::vec4, 3> previous_turn;
  glm::vec4 wind;  // w: pull_ahead_s()
  std::array<glm::vec4, shader::kMaxGustWaves> gust_amplitude;
  std::array<glm::vec4, shader::kMaxGustWaves> gust_wave;
  std::array<glm::vec4, shader::kMaxSphereColliders> collider;
  std::array<glm::vec4, 4> bust;
};
static_assert(sizeof(StepBlock) ==
              16 * (3 + 3 + 7 + 3 + 1 + 2 * shader::kMaxGustWaves + shader::kMaxSphereColliders + 4));
static_assert(shader::kMaxGustWaves == kMaxGustWaves && shader::kMaxSphereColliders == kMaxSphereColliders);

/// The block for one substep; `head` is as before it. Inputs are held to the limits of step_input.h.
StepBlock make_step_block(const StepInput& input, const StrandParameters& parameters,
                          const StrandCounts& counts, const HeadPath& head);

}  // namespace strandcast
