// The rough fibre that conserves energy (d'Eon et al. 2011 along, Chiang et al. 2016 across), in double
// precision, derived from their equations. The ground truth of all shading. Pure functions, any thread.
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

/// Variance of the inclination, of R; TT has a quarter, TRT and all others four times as much.
double longitudinal_variance(double along);
/// Scale of the logistic distribution of the azimuth.
double azimuthal_scale(double across);

/// M(theta_i, theta_o): of a variance, over cos theta_i dtheta_i it integrates to 1.
double rough_longitudinal(double variance, double theta_in, double theta_out);
/// Logistic distribution cut to -pi .. pi, area 1.
double trimmed_logistic(double scale, double x);

/// A direction to the light and one to the eye, by inclination and by the azimuth between them.
struct FibreAngles {
  double theta_in = 0.0;
  double theta_out = 0.0;
  double phi = 0.0;
};
/// R, TT, TRT and all higher ways of light that enters at `h`: f cos theta_i.
std::array<double, kLobes> rough_lobes(const RoughFibre& fibre, const FibreAngles& angles, double h);
/// Their sum, seen from so far that all h are one: mean over `count` of them, even in asin h.
double rough_far_field(const RoughFibre& fibre, const FibreAngles& angles, size_t count = 256);

}  // namespace strandcast::scatter
