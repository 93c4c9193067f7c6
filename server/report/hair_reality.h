// Compares simulated hair in air with known results: hairs and locks that lean in a steady wind, air held
// back by a bundle, and the sway of a ponytail under a head that moves up and down.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "server/report/hanging_hair.h"
#include "server/report/html_page.h"
#include "server/report/ponytail.h"
#include "server/sim/executor/executor.h"

namespace strandcast {

struct HairRealityDesc {
  std::vector<double> winds_mps = {0.2, 0.5, 1.0};
  std::vector<double> step_rates_hz = {60.0, 240.0, 960.0};  // of a single hair in the wind
  uint32_t lock_strands = 400;
  double lock_hairs = 40'000.0;
  std::vector<double> hairs_per_cm2 = {1.0, 3.0, 10.0, 30.0, 100.0, 300.0};
  double bundle_wind_mps = 1.0;
  PonytailDesc ponytails;
};

/// A limp hair in a steady wind; angles from straight down.
struct WindLean {
  double wind_mps = 0.0;
  double step_rate_hz = 0.0;
  double ours_rad = 0.0;
  double law_rad = 0.0;       // of the law that strands are dragged by
  double cylinder_rad = 0.0;  // of the published drag of a cylinder, by the flow across it alone
};

/// A limp lock of many hairs in a steady wind.
struct LockLean {
  double wind_mps = 0.0;
  double ours_rad = 0.0;
  double single_rad = 0.0;  // of one of its hairs alone, by the law
  double solid_rad = 0.0;   // of a solid cylinder as wide and as heavy
};

/// What a bundle of hairs at rest takes off the speed of a wind, of all of it, on the mean over the bundle.
struct BundleAir {
  double hairs_per_cm2 = 0.0;
  double ours = 0.0;
  double screen = 0.0;      // air is blown through: Taylor's porous plate
  double viscous = 0.0;     // air seeps in: Brinkman's layer
  double drag_share = 0.0;  // mean drag of a hair in it over that of a lone one, by ours
};

struct HairReality {
  std::vector<WindLean> hairs;
  std::vector<LockLean> locks;
  std::vector<BundleAir> bundles;
  std::vector<Ponytail> ponytails;
};

/// Receives a description of each part when it begins.
using RealityProgress = std::function<void(const std::string&)>;

Result<HairReality> measure_reality(const HairRealityDesc& desc, Executor& executor,
                                    const RealityProgress& progress);

/// Lean of a limp string in a steady horizontal wind by the law of common/kernels/volume/hair_in_air.h. Drag
/// and weight balance equally along it, so it is straight: tan(lean) = rate x wind / g.
double lawful_lean_rad(double wind_mps, double gravity_mps2);
/// The same lean by the published drag of a cylinder, of the cross flow alone (independence principle).
double cylinder_lean_rad(double wind_mps, double gravity_mps2);

/// Strands that hang limp in a steady wind, and the number of hairs that they represent.
struct HangingHair {
  Groom groom;
  double hairs = 1.0;
  double wind_mps = 0.0;  // along x
  double step_rate_hz = 240.0;
  uint32_t volume_cells = 32;
  HairCompany company{.has_air = true};
};
/// Returns the mean angle between straight down and the direction from root to tip, towards the wind, after
/// settling.
Result<double> lean_rad(const HangingHair& hair, Executor& executor);

// The part of strandcast-report coherence that compares hair in air with known results. Pure functions.

/// Returns the tables as text for a terminal.
std::string reality_text(const HairReality& reality);
void add_reality(HtmlPage& page, const HairReality& reality);

}  // namespace strandcast
