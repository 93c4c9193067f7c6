// Optics of a smooth dielectric cylinder that absorbs, in double precision: Fresnel, the indices that make a
// slanted section flat (Bravais), and how much of the light takes which way. Ground truth for the shaders and
// what tables are made from. Pure functions, any thread.
#pragma once

#include <array>
#include <cstddef>
#include <glm/glm.hpp>
#include <numbers>

namespace strandcast::scatter {
inline constexpr double kDegree = std::numbers::pi / 180.0;
/// Refractive index of hair.
inline constexpr double kHairIndex = 1.55;

/// What unpolarised light reflects at an angle of incidence with this cosine.
double fresnel(double index, double cos_incidence);

/// Indices of the section across the fibre (Marschner et al. 2003, appendix B), for light that comes at the
/// inclination `theta` to it.
struct BravaisIndices {
  double perpendicular = kHairIndex;  // eta'
  double parallel = kHairIndex;       // eta''
};
BravaisIndices bravais_indices(double index, double theta);
/// The same reflectance as fresnel() of the ray in space, from the section: sine of its angle there is h.
double section_fresnel(const BravaisIndices& indices, double h);

/// One way of the light: what a ray meets that enters at offset `h` (-1 .. 1) from the axis.
struct FibreRay {
  double index = kHairIndex;
  double theta = 0.0;  // inclination, rad
  double h = 0.0;
  double absorption = 0.0;  // per radius
};

/// Shares of the light that leaves after p = 0 (R), 1 (TT), 2 (TRT) passes, and after all higher numbers
/// together: their sum is 1 without absorption.
inline constexpr size_t kLobes = 4;
std::array<double, kLobes> lobe_shares(const FibreRay& ray);
/// Transmittance of one pass through the fibre: exp(-2 absorption cos gamma_t / cos theta_t). Marschner et
/// al. print twice the square of the cosine; the chord of a circle of radius 1 is 2 cos gamma_t.
double pass_transmittance(const FibreRay& ray);

/// Change of azimuth on the way p, rad, not wrapped: 2 p gamma_t - 2 gamma_o + p pi.
double exit_azimuth(size_t p, double index_in_section, double h);

inline double square(double x) {
  return x * x;
}

/// `angle` within -pi .. pi.
double wrapped(double angle);
/// Gaussian of area 1.
double gaussian(double width, double x);

/// Mean over h of -1 .. 1 (the fibre is thinner than a pixel), with `count` points evenly in h.
template <class Function>
double mean_over_h(size_t count, Function&& function) {
  double sum = 0.0;
  for (size_t i = 0; i < count; ++i)
    sum += function(-1.0 + 2.0 * (static_cast<double>(i) + 0.5) / static_cast<double>(count));
  return sum / static_cast<double>(count);
}

}  // namespace strandcast::scatter
