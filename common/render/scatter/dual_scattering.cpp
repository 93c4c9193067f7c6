#include "common/render/scatter/dual_scattering.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace strandcast::scatter {
namespace {

constexpr size_t kPoints = 96;
// All further ways together carry less than one part in ten thousand.
constexpr size_t kWays = 10;
constexpr double kDualHalfAngleNorm = 0.5;

}  // namespace

FibreAverages fibre_averages(const SmoothFibre& fibre, const std::array<LobeShape, 3>& shapes, double theta) {
  const double index = bravais_indices(fibre.index, theta).perpendicular;
  FibreAverages sums;
  double forward_shaped = 0.0, back_shaped = 0.0;
  // Both halves of the fibre do the same. Even in gamma = asin h all is smooth up to the edge.
  for (size_t i = 0; i < kPoints; ++i) {
    const double step = 0.5 * std::numbers::pi / kPoints, gamma = step * (static_cast<double>(i) + 0.5);
    const double h = std::sin(gamma);
    const double f = fresnel(fibre.index, std::cos(theta) * std::cos(gamma));
    const double t = pass_transmittance({fibre.index, theta, h, fibre.absorption});
    double share = f * step * std::cos(gamma);
    for (size_t p = 0; p < kWays; ++p) {
      const double ahead = std::abs(wrapped(exit_azimuth(p, index, h))) / std::numbers::pi;
      sums.forward += share * ahead;
      sums.back += share * (1.0 - ahead);
      if (p < shapes.size()) {
        forward_shaped += share * ahead;
        back_shaped += share * (1.0 - ahead);
        sums.forward_shift += share * ahead * shapes[p].shift;
        sums.forward_width += share * ahead * shapes[p].width;
        sums.back_shift += share * (1.0 - ahead) * shapes[p].shift;
        sums.back_width += share * (1.0 - ahead) * shapes[p].width;
      }
      share *= p == 0 ? square(1.0 - f) * t / f : f * t;
    }
  }
  sums.forward_shift /= forward_shaped;
  sums.forward_width /= forward_shaped;
  sums.back_shift /= back_shaped;
  sums.back_width /= back_shaped;
  return sums;
}

double forward_transmittance(const FibreAverages& averages, double count) {
  return kForwardDensity * std::pow(averages.forward, count);
}

double mean_transmittance(double forward, double count) {
  return std::exp(-count * (1.0 - forward));
}

BackScatter back_scatter(const FibreAverages& averages) {
  const double f2 = square(averages.forward), b = averages.back, b3 = b * b * b;
  const double kept = std::max(1.0 - f2, 1e-6);
  BackScatter back;
  back.albedo = b * f2 / kept + b3 * f2 / (kept * kept * kept);
  back.shift = averages.back_shift * (1.0 - 2.0 * b * b / square(kept)) +
               averages.forward_shift * (2.0 * square(kept) + 4.0 * f2 * b * b) / (kept * kept * kept);
  const double f_width = averages.forward_width, b_width = averages.back_width;
  back.width = (1.0 + kBackDensity * f2) *
               (b * std::sqrt(2.0 * square(f_width) + square(b_width)) +
                b3 * std::sqrt(2.0 * square(f_width) + 3.0 * square(b_width))) /
               (b + b3 * (2.0 * f_width + 3.0 * b_width));
  return back;
}

double back_lobe(const BackScatter& back, double theta_half, double cos_theta_diff, double spread) {
  const double width = std::sqrt(square(back.width) + spread);
  return 2.0 * back.albedo * kDualHalfAngleNorm * gaussian(width, theta_half - back.shift) /
         (std::numbers::pi * square(cos_theta_diff));
}

Ways forward_azimuthal_ways(size_t p, const SmoothFibre& fibre, double theta_diff) {
  constexpr int kAzimuths = 64;
  Ways ways;
  for (int i = 0; i < kAzimuths; ++i) {
    const double phi = std::numbers::pi * (0.5 + 0.5 * (i + 0.5) / kAzimuths);
    for (const Way& way :
         p == 2 ? azimuthal_trt_ways(fibre, theta_diff, phi) : azimuthal_ways(p, fibre, theta_diff, phi))
      ways.push_back({way.strength / kAzimuths, way.path});
  }
  return ways;
}

double forward_azimuthal(size_t p, const SmoothFibre& fibre, double theta_diff) {
  return sum_of(forward_azimuthal_ways(p, fibre, theta_diff), fibre.absorption);
}

double dual_scattering(const SmoothFibre& fibre, const std::array<LobeShape, 3>& shapes,
                       const CrowdView& view) {
  const double half = 0.5 * (view.theta_in + view.theta_out);
  const double diff = 0.5 * (view.theta_out - view.theta_in), cos_diff = std::cos(diff);
  const FibreAverages means = fibre_averages(fibre, shapes, diff);
  const double direct = std::exp(-view.crossed);
  const double forward = fibre_averages(fibre, shapes, view.theta_in).forward;
  const double indirect = mean_transmittance(forward, view.crossed) - direct;
  const double spread = view.crossed * square(means.forward_width) + kCrowdSpread;
  double scattered = 0.0;
  for (size_t p = 0; p < shapes.size(); ++p)
    scattered += longitudinal({shapes[p].shift, std::sqrt(square(shapes[p].width) + spread)}, half) *
                 forward_azimuthal(p, fibre, diff) / square(cos_diff);
  const BackScatter back = back_scatter(means);
  const double around = kBackDensity * back_lobe(back, half, cos_diff, kCrowdSpread);
  const double around_spread = std::numbers::pi * kBackDensity * back_lobe(back, half, cos_diff, spread);
  const double light = std::numbers::pi * std::cos(view.theta_in);
  return direct * (view.single + light * around) +
         kForwardDensity * light * indirect * (scattered + around_spread);
}

glm::dvec3 density_normal(const glm::dvec3& gradient, double min_slope, const glm::dvec3& fallback) {
  const double slope = glm::length(gradient);
  return slope >= min_slope ? -gradient / slope : fallback;
}

}  // namespace strandcast::scatter
