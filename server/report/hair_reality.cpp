#include "server/report/hair_reality.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/kernels/volume/hair_in_air.h"
#include "server/report/crowded_hair.h"

namespace strandcast {
namespace {

/// A single hair hardly stands in its own wake in cells so coarse.
constexpr uint32_t kSingleHairCells = 8;
constexpr double kHairSettleS = 4.0;
constexpr double kLockSettleS = 8.0;
constexpr double kLockRateHz = 240.0;
/// Of a cylinder at Reynolds numbers of 1e3 to 1e5.
constexpr double kSolidDrag = 1.1;
/// Width of the tuft where the wind meets it: make_tuft's roots, and a little flare.
constexpr double kTuftWidthM = 0.06;

/// Sucker and Brauer 1975, as hair_in_air.h names it, with their powers.
double published_drag(double reynolds) {
  return 6.8 * std::pow(reynolds, -0.89) + 1.96 / std::sqrt(reynolds) + 1.18 -
         4e-4 * reynolds / (1.0 + 3.64e-7 * reynolds * reynolds);
}

/// Where a growing function is 0, between two places.
template <class Function>
double root_of(const Function& function, double low, double high) {
  constexpr int kHalvings = 80;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (function(middle) < 0.0 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

// ---- bundles ----

/// Taylor 1944, "Air resistance of a flat plate of very porous material": air goes through at u / (1 + k /
/// 4). Its k is the pressure lost there over (density x speed^2 / 2); here by the hairs' drag at that speed.
double screen_carried(const AirDesc& air, double hairs_per_m2, double wind_mps) {
  const double through_mps = root_of(
      [&](double speed_mps) {
        const double loss = 2.0 * hairs_per_m2 * air.lock_width_m * stopping_width_m(air, speed_mps);
        return speed_mps * (1.0 + 0.25 * loss) - wind_mps;
      },
      0.0, wind_mps);
  return 1.0 - through_mps / wind_mps;
}

/// Brinkman 1949: a layer as wide as a lock, with moving air at its faces. Momentum seeps in by the way
/// sqrt(viscosity / drag per volume and speed); mean of 1 - cosh(y / way) / cosh(half / way).
double viscous_carried(const AirDesc& air, double hairs_per_m2, double wind_mps) {
  const double drag_per_speed = kAirDensityKgpm3 * wind_mps * stopping_width_m(air, wind_mps);
  const double way_m = std::sqrt(kAirDensityKgpm3 * kAirViscosityM2ps / (hairs_per_m2 * drag_per_speed));
  const double half = 0.5 * air.lock_width_m / way_m;
  return 1.0 - std::tanh(half) / half;
}

/// Mean over a way, of which `function` takes the share that lies behind.
template <class Function>
double mean_of_way(const Function& function) {
  constexpr int kParts = 256;
  double sum = 0.0;
  for (int i = 0; i < kParts; ++i) sum += function((i + 0.5) / kParts);
  return sum / kParts;
}

std::vector<BundleAir> measure_bundles(const HairRealityDesc& desc) {
  constexpr double kPerCm2 = 1e4;
  const AirDesc air;
  std::vector<BundleAir> bundles;
  for (const double per_cm2 : desc.hairs_per_cm2) {
    const double hairs_per_m2 = kPerCm2 * per_cm2;
    const double wind_mps = desc.bundle_wind_mps;
    BundleAir bundle;
    bundle.hairs_per_cm2 = per_cm2;
    const auto speed_mps = [&](double way_share) {
      const double hairs_per_m = hairs_per_m2 * way_share * air.lock_width_m;
      return wind_mps * arriving_wind_share(air, hairs_per_m, wind_mps) *
             met_wind_share(carried_air_share(air, hairs_per_m2, wind_mps));
    };
    bundle.ours = 1.0 - mean_of_way(speed_mps) / wind_mps;
    bundle.screen = screen_carried(air, hairs_per_m2, wind_mps);
    bundle.viscous = viscous_carried(air, hairs_per_m2, wind_mps);
    const auto pull = [&](double at_mps) { return at_mps * air_rate_per_s(air, at_mps); };
    bundle.drag_share =
        mean_of_way([&](double way_share) { return pull(speed_mps(way_share)); }) / pull(wind_mps);
    bundles.push_back(bundle);
  }
  return bundles;
}

// ---- wind ----

Result<std::vector<WindLean>> measure_hairs(const HairRealityDesc& desc, Executor& executor) {
  std::vector<WindLean> leans;
  for (const double rate_hz : desc.step_rates_hz)
    for (const double wind_mps : desc.winds_mps) {
      HangingHair hair;
      hair.groom = make_hanging_hair(kHangingVertices, kHangingLengthM);
      hair.wind_mps = wind_mps;
      hair.step_rate_hz = rate_hz;
      hair.volume_cells = kSingleHairCells;
      WindLean lean{wind_mps, rate_hz};
      ASSIGN_OR_RETURN(lean.ours_rad, lean_rad(hair, executor));
      lean.law_rad = lawful_lean_rad(wind_mps, kEarthMps2);
      lean.cylinder_rad = cylinder_lean_rad(wind_mps, kEarthMps2);
      leans.push_back(lean);
    }
  return leans;
}

Result<std::vector<LockLean>> measure_locks(const HairRealityDesc& desc, Executor& executor) {
  std::vector<LockLean> leans;
  HangingHair lock;
  lock.groom = make_tuft(desc.lock_strands, kHangingVertices, kHangingLengthM, kHangingSeed);
  lock.hairs = desc.lock_hairs;
  lock.step_rate_hz = kLockRateHz;
  lock.company.has_contact = true;
  ASSIGN_OR_RETURN(const double windless_rad, lean_rad(lock, executor));
  for (const double wind_mps : desc.winds_mps) {
    lock.wind_mps = wind_mps;
    LockLean lean;
    lean.wind_mps = wind_mps;
    ASSIGN_OR_RETURN(const double blown_rad, lean_rad(lock, executor));
    lean.ours_rad = blown_rad - windless_rad;
    lean.single_rad = lawful_lean_rad(wind_mps, kEarthMps2);
    const AirDesc air;
    const double kg_per_m =
        desc.lock_hairs * air.hair_density_kgpm3 * std::numbers::pi * air.hair_radius_m * air.hair_radius_m;
    const double force_npm = 0.5 * kAirDensityKgpm3 * kTuftWidthM * kSolidDrag * wind_mps * wind_mps;
    lean.solid_rad = std::atan(force_npm / (kg_per_m * kEarthMps2));
    leans.push_back(lean);
  }
  return leans;
}

}  // namespace

double lawful_lean_rad(double wind_mps, double gravity_mps2) {
  return std::atan(air_rate_per_s(AirDesc{}, wind_mps) * wind_mps / gravity_mps2);
}

double cylinder_lean_rad(double wind_mps, double gravity_mps2) {
  const AirDesc air;
  const double kg_per_m = air.hair_density_kgpm3 * std::numbers::pi * air.hair_radius_m * air.hair_radius_m;
  return root_of(
      [&](double lean) {
        const double across_mps = wind_mps * std::cos(lean);
        const double reynolds = std::max(reynolds_per_mps(air) * across_mps, 1e-4);
        const double force_npm =
            kAirDensityKgpm3 * air.hair_radius_m * published_drag(reynolds) * across_mps * across_mps;
        return kg_per_m * gravity_mps2 * std::sin(lean) - force_npm;
      },
      0.0, 0.5 * std::numbers::pi);
}

Result<double> lean_rad(const HangingHair& hair, Executor& executor) {
  SceneDesc scene = hanging_scene(hair.step_rate_hz);
  scene.solver = limp_rod();
  scene.wind.mean_mps = {static_cast<float>(hair.wind_mps), 0.0f, 0.0f};
  scene.volume = volume_of(hair.company);
  scene.volume.air.hairs = hair.hairs;
  scene.volume.resolution = hair.volume_cells;
  SceneContent content;
  content.groom = hair.groom;
  ASSIGN_OR_RETURN(HairRun run, HairRun::make(executor, scene, content));
  const StrandLayout& layout = run.layout();
  const auto steps =
      std::llround((layout.strand_count > 1 ? kLockSettleS : kHairSettleS) * scene.step_rate_hz);
  glm::dvec3 way(0.0);
  for (int64_t step = 1; step <= steps; ++step) {
    run.step({{0.0, kHangingHeightM, 0.0}, glm::dquat(1.0, 0.0, 0.0, 0.0)});
    if (2 * step < steps) continue;
    for (uint32_t strand = 0; strand < layout.strand_count; ++strand)
      way += glm::dvec3(run.position_in_head_m()[layout.index(layout.vertex_count - 1, strand)]) -
             glm::dvec3(run.position_in_head_m()[strand]);
  }
  return std::atan2(way.x, -way.y);
}

Result<HairReality> measure_reality(const HairRealityDesc& desc, Executor& executor,
                                    const RealityProgress& progress) {
  HairReality reality;
  progress("a hair in the wind");
  ASSIGN_OR_RETURN(reality.hairs, measure_hairs(desc, executor));
  progress("a lock in the wind");
  ASSIGN_OR_RETURN(reality.locks, measure_locks(desc, executor));
  reality.bundles = measure_bundles(desc);
  progress("a ponytail on a head that goes up and down");
  ASSIGN_OR_RETURN(reality.ponytails, measure_ponytails(desc.ponytails, executor));
  return reality;
}

}  // namespace strandcast
