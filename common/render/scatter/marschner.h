// The smooth fibre of Marschner et al. 2003 ("Light Scattering from Human Hair Fibers"), in double precision:
// S = sum over p of M_p(theta_h) N_p(eta', phi) / cos^2 theta_d. Deviations, each with its reason: half of M,
// and the chord's absorption (fibre_optics.h). Pure functions, any thread.
#pragma once

#include <array>
#include <vector>

#include "common/render/scatter/fibre_optics.h"

namespace strandcast::scatter {

/// Treatment of TRT's caustics, which diffraction and surface roughness smooth (section 5.2.2 and table 1 of
/// the paper).
struct CausticTerms {
  double power = 2.5;           // k_G, 0.5 .. 5
  double width = 15 * kDegree;  // w_c, 10 .. 25 degrees
  double fade = 0.3;            // delta eta', 0.2 .. 0.4
  double max_width_h = 0.5;     // delta h_M
};

struct SmoothFibre {
  double index = kHairIndex;
  double absorption = 0.0;  // per radius
  CausticTerms caustic;
};

/// Longitudinal shifts and widths of R, TT and TRT in the half angle: alpha_R = `shift_r`, alpha_TT =
/// -alpha_R / 2, alpha_TRT = -3 alpha_R / 2; beta_TT = beta_R / 2, beta_TRT = 2 beta_R.
struct LobeShape {
  double shift = 0.0;  // rad
  double width = 0.0;  // rad
};
std::array<LobeShape, 3> lobe_shapes(double width_r, double shift_r);
/// Longitudinal Gaussian with area 1 over the outgoing angle; an area of 1 in the half angle would be about 2
/// there.
double longitudinal(const LobeShape& shape, double theta_half);

/// Cubic approximation of the exit azimuth Phi(p, gamma), and the entry angles gamma whose light leaves at
/// `phi`.
double cubic_exit(size_t p, double index_in_section, double gamma);
std::vector<double> exit_roots(size_t p, double index_in_section, double phi);

/// One term of N_p: strength * exp(-absorption * path).
struct Way {
  double strength = 0.0;
  double path = 0.0;  // radii
};
using Ways = std::vector<Way>;
double sum_of(const Ways& ways, double absorption);
/// Terms that azimuthal() and azimuthal_trt() sum, independent of the absorption of `fibre`.
Ways azimuthal_ways(size_t p, const SmoothFibre& fibre, double theta_diff, double phi);
Ways azimuthal_trt_ways(const SmoothFibre& fibre, double theta_diff, double phi);

/// Azimuthal function N_p of the plain model; infinite on caustics.
double azimuthal(size_t p, const SmoothFibre& fibre, double theta_diff, double phi);
/// Azimuthal function with the exact law of refraction instead of the cubic.
double azimuthal_exact(size_t p, const SmoothFibre& fibre, double theta_diff, double phi);

/// Azimuth at which two entries of TRT coincide. Exists only for eta' < 2.
struct Caustic {
  bool exists = false;
  double gamma = 0.0;
  double h = 0.0;
  double phi = 0.0;
};
Caustic trt_caustic(double index_in_section);
/// Azimuthal function N_TRT with the caustics removed and replaced by smooth lobes.
double azimuthal_trt(const SmoothFibre& fibre, double theta_diff, double phi);

/// Effective refractive index of an elliptic section for TRT at the mean azimuth phi_half; `eccentricity`
/// 0.85 .. 1.
double elliptic_index(double index, double eccentricity, double phi_half);

/// Lobes R, TT and TRT with caustics, times cos theta_i: the reflected part of a unit of light.
std::array<double, 3> marschner_lobes(const SmoothFibre& fibre, const std::array<LobeShape, 3>& shapes,
                                      double theta_in, double theta_out, double phi);

}  // namespace strandcast::scatter
