#include "common/render/scatter/chiang.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace strandcast::scatter {
namespace {

double log_bessel_0(double x) {
  constexpr double kLarge = 12.0;
  if (x > kLarge) return x + 0.5 * (std::log(1.0 / (2.0 * std::numbers::pi * x)) + 1.0 / (4.0 * x));
  // Power series of I0.
  double term = 1.0, sum = 1.0;
  for (int i = 1; i < 60; ++i) {
    term *= x * x / (4.0 * i * i);
    sum += term;
  }
  return std::log(sum);
}

}  // namespace

double longitudinal_variance(double along) {
  const double root = 0.726 * along + 0.812 * along * along + 3.7 * std::pow(along, 20.0);
  return root * root;
}

double azimuthal_scale(double across) {
  return std::sqrt(std::numbers::pi / 8.0) *
         (0.265 * across + 1.194 * across * across + 5.372 * std::pow(across, 22.0));
}

double rough_longitudinal(double variance, double theta_in, double theta_out) {
  // The cosine of an inclination that the scales turn past the fibre's end counts as positive.
  const double cosines = std::abs(std::cos(theta_in) * std::cos(theta_out)) / variance;
  const double sines = std::sin(theta_in) * std::sin(theta_out) / variance;
  // log(2 sinh(1/v)) without overflow.
  const double norm = 1.0 / variance + std::log1p(-std::exp(-2.0 / variance));
  return std::exp(log_bessel_0(cosines) - sines - norm) / variance;
}

double trimmed_logistic(double scale, double x) {
  const double decay = std::exp(-std::abs(x) / scale);
  const auto below = [&](double at) { return 1.0 / (1.0 + std::exp(-at / scale)); };
  return decay / (scale * (1.0 + decay) * (1.0 + decay)) /
         (below(std::numbers::pi) - below(-std::numbers::pi));
}

std::array<double, kLobes> rough_lobes(const RoughFibre& fibre, const FibreAngles& angles, double h) {
  const double variance = longitudinal_variance(fibre.along);
  const double scale = azimuthal_scale(fibre.across);
  const std::array<double, kLobes> variances{variance, 0.25 * variance, 4.0 * variance, 4.0 * variance};
  // Scales turn a ray that reflects by twice their tilt, and take back a part at each pass.
  const std::array<double, kLobes> tilts{2.0 * fibre.tilt, -fibre.tilt, -4.0 * fibre.tilt, 0.0};
  const auto shares = lobe_shares({fibre.index, angles.theta_out, h, fibre.absorption});
  const double index = bravais_indices(fibre.index, angles.theta_out).perpendicular;
  std::array<double, kLobes> lobes{};
  for (size_t p = 0; p < kLobes; ++p) {
    const double across = p + 1 < kLobes
                              ? trimmed_logistic(scale, wrapped(angles.phi - exit_azimuth(p, index, h)))
                              : 1.0 / (2.0 * std::numbers::pi);
    lobes[p] =
        rough_longitudinal(variances[p], angles.theta_in + tilts[p], angles.theta_out) * shares[p] * across;
  }
  return lobes;
}

double rough_far_field(const RoughFibre& fibre, const FibreAngles& angles, size_t count) {
  double sum = 0.0;
  for (size_t i = 0; i < count; ++i) {
    const double gamma =
        std::numbers::pi * ((static_cast<double>(i) + 0.5) / static_cast<double>(count) - 0.5);
    const auto lobes = rough_lobes(fibre, angles, std::sin(gamma));
    sum += std::cos(gamma) * (lobes[0] + lobes[1] + lobes[2] + lobes[3]);
  }
  return 0.5 * std::numbers::pi * sum / static_cast<double>(count);
}

}  // namespace strandcast::scatter
