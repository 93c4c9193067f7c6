// Energy-conserving rough fibre (d'Eon et al. 2011 along, Chiang et al. 2016 across), in double precision,
// derived from their equations. Reference for all shading models. Pure functions, any thread.
#pragma once

#include <array>

#include "common/render/scatter/fibre_optics.h"

namespace strandcast::scatter {

struct RoughFibre {
  double index = kHairIndex;
  double absorption = 0.25;     // per radius
  double along = 0.3;           // roughness beta_m, 0..1
  double across = 0.3;          // roughness beta_n, 0..1
  double tilt = 2.0 * kDegree;  // of the scales
};

/// Variance of the inclination for R; TT has a quarter of it, TRT and all later lobes four times as much.
double longitudinal_variance(double along);
/// Scale of the logistic distribution of azimuth for this roughness.
double azimuthal_scale(double across);

/// Longitudinal function M(theta_i, theta_o) with this variance; over cos theta_i dtheta_i it integrates to
/// 1.
double rough_longitudinal(double variance, double theta_in, double theta_out);
/// Logistic distribution truncated to -pi .. pi, area 1.
double trimmed_logistic(double scale, double x);

/// Directions to the light and to the eye: inclinations, and the azimuth between them.
struct FibreAngles {
  double theta_in = 0.0;
  double theta_out = 0.0;
  double phi = 0.0;
};
/// Lobes R, TT, TRT and the sum of all later ones for light that enters at offset `h`: f cos theta_i.
std::array<double, kLobes> rough_lobes(const RoughFibre& fibre, const FibreAngles& angles, double h);
/// Sum of the lobes averaged over the fibre's width, as seen from far away: mean over `count` offsets h,
/// evenly spaced in asin h.
double rough_far_field(const RoughFibre& fibre, const FibreAngles& angles, size_t count = 256);

}  // namespace strandcast::scatter
