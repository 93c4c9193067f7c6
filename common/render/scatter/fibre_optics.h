// Optics of a smooth absorbing dielectric cylinder, in double precision: Fresnel reflection, Bravais indices
// of the cross-section, and the shares of light on each path. Reference for shaders and source of lookup
// tables. Pure functions, any thread.
#pragma once

#include <array>
#include <cstddef>
#include <glm/glm.hpp>
#include <numbers>

namespace strandcast::scatter {
inline constexpr double kDegree = std::numbers::pi / 180.0;
/// Refractive index of hair.
inline constexpr double kHairIndex = 1.55;

/// Reflectance of unpolarised light for this cosine of the angle of incidence.
double fresnel(double index, double cos_incidence);

/// Refractive indices in the cross-section of the fibre (Marschner et al. 2003, appendix B) for light at
/// inclination `theta` to it.
struct BravaisIndices {
  double perpendicular = kHairIndex;  // eta'
  double parallel = kHairIndex;       // eta''
};
BravaisIndices bravais_indices(double index, double theta);
/// Fresnel reflectance computed in the cross-section, equal to fresnel() of the ray in space; h is the sine
/// of its angle there.
double section_fresnel(const BravaisIndices& indices, double h);

/// A ray that enters at offset `h` (-1 .. 1) from the axis, with the optics that it meets.
struct FibreRay {
  double index = kHairIndex;
  double theta = 0.0;  // inclination, rad
  double h = 0.0;
  double absorption = 0.0;  // per radius
};

/// Shares of the light that leaves after p = 0 (R), 1 (TT) and 2 (TRT) passes, and after all higher numbers
/// together. They sum to 1 without absorption.
inline constexpr size_t kLobes = 4;
std::array<double, kLobes> lobe_shares(const FibreRay& ray);
/// Transmittance of one pass through the fibre: exp(-2 absorption cos gamma_t / cos theta_t). Deviation:
/// Marschner et al. print twice the square of the cosine, but the chord of a circle of radius 1 is 2 cos
/// gamma_t.
double pass_transmittance(const FibreRay& ray);

/// Change of azimuth after p passes, rad, not wrapped: 2 p gamma_t - 2 gamma_o + p pi.
double exit_azimuth(size_t p, double index_in_section, double h);

inline double square(double x) {
  return x * x;
}

/// Returns `angle` wrapped to -pi .. pi.
double wrapped(double angle);
/// Gaussian of area 1 with this standard deviation.
double gaussian(double width, double x);

/// Mean over h of -1 .. 1, for fibres thinner than a pixel, from `count` points evenly spaced in h.
template <class Function>
double mean_over_h(size_t count, Function&& function) {
  double sum = 0.0;
  for (size_t i = 0; i < count; ++i)
    sum += function(-1.0 + 2.0 * (static_cast<double>(i) + 0.5) / static_cast<double>(count));
  return sum / static_cast<double>(count);
}

}  // namespace strandcast::scatter
