// Hair in air: how fast air carries a hair along, and how much of the air a lock of hair carries along
// itself. Plain functions in double precision; shaders/sim/volume_forces.comp does the same for strands, with
// the numbers that are here.
// Any thread.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

namespace strandcast {

inline constexpr double kAirDensityKgpm3 = 1.204;      // at 20 C
inline constexpr double kAirViscosityM2ps = 1.516e-5;  // kinematic, likewise
inline constexpr double kHairRadiusM = 5e-5;
inline constexpr double kHairDensityKgpm3 = 1300.0;
/// Hairs of a head (100,000 to 150,000 are usual).
inline constexpr double kHairsOfHead = 100'000.0;

/// What a scene says of the air around its hair. Plain data.
struct AirDesc {
  bool acts = false;
  double hairs = kHairsOfHead;  // real ones that all strands together stand for
  double lock_width_m = 0.015;  // of hair that air passes through, rather than around it
  double hair_radius_m = kHairRadiusM;
  double hair_density_kgpm3 = kHairDensityKgpm3;
  bool has_wind = true;  // false: nobody asks what of the wind reaches a place

  bool operator==(const AirDesc&) const = default;
};

/// Drag coefficient times Reynolds number of a cylinder across the flow: Sucker and Brauer 1975, 1e-4 < Re <
/// 2e5, without their term of 4e-4 Re^2 / (1 + 3.64e-7 Re^2), which hair does not reach. Re^0.11 stands
/// as 7.0 / 6.8 x Re^(1/8), which takes roots alone: within 3 % of theirs from Re 0.03 to 45 (hair: 5 mm/s to
/// 7 m/s).
inline double drag_number(double reynolds) {
  const double root = std::sqrt(reynolds);
  return 7.0 * std::sqrt(std::sqrt(root)) + 1.96 * root + 1.18 * reynolds;
}

inline double reynolds_per_mps(const AirDesc& air) {
  return 2.0 * air.hair_radius_m / kAirViscosityM2ps;
}

/// Factor of drag_number() to the rate at which a hair across the flow takes on the air's velocity, 1/s:
/// force per length over mass per length and speed.
inline double air_rate_scale_per_s(const AirDesc& air) {
  const double kg_per_m = air.hair_density_kgpm3 * std::numbers::pi * air.hair_radius_m * air.hair_radius_m;
  return kAirDensityKgpm3 * kAirViscosityM2ps / (2.0 * kg_per_m);
}
inline double air_rate_per_s(const AirDesc& air, double speed_mps) {
  return air_rate_scale_per_s(air) * drag_number(reynolds_per_mps(air) * speed_mps);
}

/// Width by which one hair across the wind stops it: force per length over (air density x speed^2), m.
inline double stopping_width_m(const AirDesc& air, double speed_mps) {
  const double reynolds = std::max(reynolds_per_mps(air) * speed_mps, 1e-6);
  return air.hair_radius_m * drag_number(reynolds) / reynolds;
}

/// Share of the air between `hairs_per_m2` hairs that moves with them, when they move so fast against the air
/// around their lock: drag of all hairs on the way through the lock, over that and what the air brings along.
inline double carried_air_share(const AirDesc& air, double hairs_per_m2, double speed_mps) {
  const double reynolds = std::max(reynolds_per_mps(air) * speed_mps, 1e-6);
  const double pulled = hairs_per_m2 * air.lock_width_m * air.hair_radius_m * drag_number(reynolds);
  return pulled / (pulled + reynolds);
}

/// Share of the drag across a hair that acts along it (slender bodies at low Reynolds numbers).
inline constexpr double kAlongShare = 0.5;
/// Air also goes around hair that lets little through: of its momentum, that of a drag coefficient of 2, a
/// solid cylinder takes 1.1. 1 - sqrt(1.1 / 2).
inline constexpr double kAroundShare = 0.25838;

/// Speed over that of the wind which a lock meets, where hair carries `carried_share` of the air with it.
inline double met_wind_share(double carried_share) {
  return 1.0 - kAroundShare * carried_share;
}

/// Returns the share of a wind's speed that reaches hair behind other hair. The drag of that hair adds up
/// over `hairs_per_m` hairs on a metre across the wind.
inline double arriving_wind_share(const AirDesc& air, double hairs_per_m, double speed_mps) {
  return std::exp(-hairs_per_m * stopping_width_m(air, speed_mps));
}

/// How much more inert air that drags a hair at this rate makes it for all other forces in a step. They do
/// less: hair that rests in a wind then leans as far as drag and weight say, at any step rate.
inline double inertia_in_air(double step_s, double rate_per_s) {
  const double faded = step_s * rate_per_s;
  return faded > 0.0 ? faded / -std::expm1(-faded) : 1.0;
}

}  // namespace strandcast
