// Dual scattering (Zinke et al. 2008), in double precision: what a fibre among others scatters forward and
// back, and what many of them do. And diffuse light by the normal of a density (Petrovic et al. 2005). Pure
// functions, any thread.
#pragma once

#include <array>
#include <glm/glm.hpp>

#include "common/render/scatter/marschner.h"

namespace strandcast::scatter {

/// Of light that meets a fibre: what goes on and what comes back, and how it is spread along the fibre.
struct FibreAverages {
  double forward = 0.0;        // a_f
  double back = 0.0;           // a_b
  double forward_shift = 0.0;  // alpha_f, rad
  double back_shift = 0.0;     // alpha_b
  double forward_width = 0.0;  // beta_f
  double back_width = 0.0;     // beta_b
};
/// A circular fibre of any azimuthal lobes: a_f = mean over h of sum A_p |Phi_p| / pi, and the rest is a_b.
/// All ways of the light are summed; the shapes are those of the first three, weighted by what they carry.
FibreAverages fibre_averages(const SmoothFibre& fibre, const std::array<LobeShape, 3>& shapes, double theta);

/// Share of the neighbours' light that scatters again: d_f and d_b.
inline constexpr double kForwardDensity = 0.7;
inline constexpr double kBackDensity = 0.7;

/// T_f behind `count` strands, equation 5.
double forward_transmittance(const FibreAverages& averages, double count);
/// Its mean, without d_f, when `count` is the mean of a number of strands that chance spreads (Poisson); the
/// share exp(-count) of it has met none.
double mean_transmittance(double forward, double count);

/// Light that comes back from the strands around: A_b, Delta_b and sigma_b, equations 14 to 16.
struct BackScatter {
  double albedo = 0.0;
  double shift = 0.0;  // rad
  double width = 0.0;  // rad
};
BackScatter back_scatter(const FibreAverages& averages);
/// f_back, of half the sphere; `spread`: variance that the light got on its way, rad^2.
double back_lobe(const BackScatter& back, double theta_half, double cos_theta_diff, double spread);

/// Mean of N_p over the half of the azimuths that light which was scattered forward comes from: (2 / pi)
/// times the integral of N_p over pi/2 .. pi.
double forward_azimuthal(size_t p, const SmoothFibre& fibre, double theta_diff);
/// What it sums, whatever `fibre` absorbs.
Ways forward_azimuthal_ways(size_t p, const SmoothFibre& fibre, double theta_diff);

/// The strands around one are not parallel to it, as the paper has them: variance of what they scatter,
/// rad^2.
inline constexpr double kCrowdSpread = (20.0 * kDegree) * (20.0 * kDegree);
struct CrowdView {
  double theta_in = 0.0;
  double theta_out = 0.0;
  double crossed = 0.0;  // mean number of strands on the light's way
  double single = 0.0;   // f_s cos theta_i of the strand itself
};
/// What goes to the eye of a unit of light in front of the hair, as light of a white surface (divided by pi).
/// Deviations from the paper: a strand has the part of the direct light with which none was crossed, where
/// there it has all or nothing; and kCrowdSpread.
double dual_scattering(const SmoothFibre& fibre, const std::array<LobeShape, 3>& shapes,
                       const CrowdView& view);

/// Normal of the surface on which a density is constant, outward: against its gradient. `fallback` where the
/// density is flat: below `min_slope` of change per length.
glm::dvec3 density_normal(const glm::dvec3& gradient, double min_slope, const glm::dvec3& fallback);

}  // namespace strandcast::scatter
