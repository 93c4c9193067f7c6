// Dual scattering (Zinke et al. 2008), in double precision: forward and backward scattering of a fibre among
// others, and of many. Also diffuse light by the normal of a density (Petrovic et al. 2005). Pure functions,
// any thread.
#pragma once

#include <array>
#include <glm/glm.hpp>

#include "common/render/scatter/marschner.h"

namespace strandcast::scatter {

/// Light that meets a fibre: shares scattered forward and back, and their spread along the fibre.
struct FibreAverages {
  double forward = 0.0;        // a_f
  double back = 0.0;           // a_b
  double forward_shift = 0.0;  // alpha_f, rad
  double back_shift = 0.0;     // alpha_b
  double forward_width = 0.0;  // beta_f
  double back_width = 0.0;     // beta_b
};
/// Averages of a circular fibre with any azimuthal lobes: a_f = mean over h of sum A_p |Phi_p| / pi, and a_b
/// is the rest. All paths of light are summed; spreads are those of the first three, weighted by their
/// energy.
FibreAverages fibre_averages(const SmoothFibre& fibre, const std::array<LobeShape, 3>& shapes, double theta);

/// Density factors d_f and d_b: share of the neighbours' light that scatters again.
inline constexpr double kForwardDensity = 0.7;
inline constexpr double kBackDensity = 0.7;

/// Transmittance T_f behind `count` strands, equation 5.
double forward_transmittance(const FibreAverages& averages, double count);
/// Mean of the transmittance, without d_f, if the number of strands is Poisson-distributed with mean `count`.
/// A share of exp(-count) meets no strand.
double mean_transmittance(double forward, double count);

/// Light scattered back by surrounding strands: A_b, Delta_b and sigma_b, equations 14 to 16.
struct BackScatter {
  double albedo = 0.0;
  double shift = 0.0;  // rad
  double width = 0.0;  // rad
};
BackScatter back_scatter(const FibreAverages& averages);
/// Back lobe f_back for light from a hemisphere; `spread` is the variance that the light gained on its way,
/// rad^2.
double back_lobe(const BackScatter& back, double theta_half, double cos_theta_diff, double spread);

/// Mean of N_p over the azimuths from which forward-scattered light comes: (2 / pi) times the integral of N_p
/// over pi/2 .. pi.
double forward_azimuthal(size_t p, const SmoothFibre& fibre, double theta_diff);
/// Paths that forward_azimuthal() sums, independent of the absorption of `fibre`.
Ways forward_azimuthal_ways(size_t p, const SmoothFibre& fibre, double theta_diff);

/// Additional variance of scattered light, rad^2, since surrounding strands are not parallel as the paper
/// assumes.
inline constexpr double kCrowdSpread = (20.0 * kDegree) * (20.0 * kDegree);
struct CrowdView {
  double theta_in = 0.0;
  double theta_out = 0.0;
  double crossed = 0.0;  // mean number of strands on the light's way
  double single = 0.0;   // f_s cos theta_i of the strand itself
};
/// Share of a unit of light in front of the hair that reaches the eye, relative to a white surface (divided
/// by pi). Deviations from the paper: the direct part is weighted by the probability that no strand was
/// crossed, not all or nothing; and kCrowdSpread.
double dual_scattering(const SmoothFibre& fibre, const std::array<LobeShape, 3>& shapes,
                       const CrowdView& view);

/// Outward normal of a surface of constant density, against its gradient. Returns `fallback` where the
/// density is flat: a slope below `min_slope` per length.
glm::dvec3 density_normal(const glm::dvec3& gradient, double min_slope, const glm::dvec3& fallback);

}  // namespace strandcast::scatter
