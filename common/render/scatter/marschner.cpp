#include "common/render/scatter/marschner.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace strandcast::scatter {
namespace {

// A unit Gaussian in the half angle integrates to 2 over the outgoing angle.
constexpr double kHalfAngleNorm = 0.5;
constexpr double kMinCosine = 0.02;
// Phi(p, .) covers less than three turns; directions that differ by turns are the same.
constexpr int kTurns = 2;

double cubic_slope(size_t p, double index_in_section, double gamma) {
  const auto passes = static_cast<double>(p);
  const double c = std::asin(1.0 / index_in_section);
  return 6.0 * passes * c / std::numbers::pi - 2.0 -
         24.0 * passes * c / (std::numbers::pi * std::numbers::pi * std::numbers::pi) * gamma * gamma;
}

/// Real roots of a x^3 + b x + d.
std::vector<double> cubic_roots(double a, double b, double d) {
  if (a == 0.0) return b == 0.0 ? std::vector<double>{} : std::vector<double>{-d / b};
  const double p = b / a, q = d / a;
  const double discriminant = q * q / 4.0 + p * p * p / 27.0;
  if (discriminant > 0.0) {
    // The larger of the two cube roots first: no cancellation.
    const double root = std::sqrt(discriminant);
    const double u = std::cbrt(q > 0.0 ? -q / 2.0 - root : -q / 2.0 + root);
    return {u == 0.0 ? 0.0 : u - p / (3.0 * u)};
  }
  if (p >= 0.0) return {0.0};
  const double radius = 2.0 * std::sqrt(-p / 3.0);
  const double angle = std::acos(std::clamp(3.0 * q / (p * radius), -1.0, 1.0)) / 3.0;
  std::vector<double> roots;
  for (int k = 0; k < 3; ++k) roots.push_back(radius * std::cos(angle - 2.0 * std::numbers::pi * k / 3.0));
  return roots;
}

/// `spread` times what takes the way p from `h`.
Way way_at(size_t p, const SmoothFibre& fibre, double theta_diff, double h, double spread) {
  const double clear = lobe_shares({fibre.index, theta_diff, h, 0.0})[p];
  // One pass takes -log of its transmittance at absorption 1.
  const double pass = -std::log(pass_transmittance({fibre.index, theta_diff, h, 1.0}));
  return {clear * spread, static_cast<double>(p) * pass};
}

double smooth_step(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

}  // namespace

std::array<LobeShape, 3> lobe_shapes(double width_r, double shift_r) {
  return {{{shift_r, width_r}, {-0.5 * shift_r, 0.5 * width_r}, {-1.5 * shift_r, 2.0 * width_r}}};
}

double longitudinal(const LobeShape& shape, double theta_half) {
  return kHalfAngleNorm * gaussian(shape.width, theta_half - shape.shift);
}

double cubic_exit(size_t p, double index_in_section, double gamma) {
  const auto passes = static_cast<double>(p);
  const double c = std::asin(1.0 / index_in_section);
  return (6.0 * passes * c / std::numbers::pi - 2.0) * gamma -
         8.0 * passes * c / (std::numbers::pi * std::numbers::pi * std::numbers::pi) * gamma * gamma * gamma +
         passes * std::numbers::pi;
}

std::vector<double> exit_roots(size_t p, double index_in_section, double phi) {
  const auto passes = static_cast<double>(p);
  const double c = std::asin(1.0 / index_in_section);
  const double linear = 6.0 * passes * c / std::numbers::pi - 2.0;
  const double cubic = -8.0 * passes * c / (std::numbers::pi * std::numbers::pi * std::numbers::pi);
  std::vector<double> inside;
  for (int turn = -kTurns; turn <= kTurns; ++turn)
    for (const double root :
         cubic_roots(cubic, linear, passes * std::numbers::pi - phi - 2.0 * std::numbers::pi * turn))
      if (std::abs(root) < std::numbers::pi / 2.0) inside.push_back(root);
  std::sort(inside.begin(), inside.end());
  return inside;
}

double sum_of(const Ways& ways, double absorption) {
  double sum = 0.0;
  for (const Way& way : ways) sum += way.strength * std::exp(-absorption * way.path);
  return sum;
}

Ways azimuthal_ways(size_t p, const SmoothFibre& fibre, double theta_diff, double phi) {
  const double index = bravais_indices(fibre.index, theta_diff).perpendicular;
  Ways ways;
  for (const double gamma : exit_roots(p, index, phi)) {
    const double slope_by_h = std::abs(cubic_slope(p, index, gamma)) / std::cos(gamma);
    ways.push_back(way_at(p, fibre, theta_diff, std::sin(gamma), 1.0 / (2.0 * slope_by_h)));
  }
  return ways;
}

double azimuthal(size_t p, const SmoothFibre& fibre, double theta_diff, double phi) {
  return sum_of(azimuthal_ways(p, fibre, theta_diff, phi), fibre.absorption);
}

double azimuthal_exact(size_t p, const SmoothFibre& fibre, double theta_diff, double phi) {
  constexpr int kSteps = 4000;
  constexpr int kHalvings = 50;
  const double index = bravais_indices(fibre.index, theta_diff).perpendicular;
  const auto miss = [&](double gamma) { return exit_azimuth(p, index, std::sin(gamma)) - phi; };
  double sum = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    // An odd number of points, so that none falls on gamma = 0 where symmetric roots lie.
    double low = std::numbers::pi * ((i + 0.25) / (kSteps + 0.5) - 0.5),
           high = std::numbers::pi * ((i + 1.25) / (kSteps + 0.5) - 0.5);
    if (std::signbit(wrapped(miss(low))) == std::signbit(wrapped(miss(high))) ||
        std::abs(wrapped(miss(low))) > std::numbers::pi / 2.0)
      continue;
    for (int halving = 0; halving < kHalvings; ++halving) {
      const double middle = 0.5 * (low + high);
      (std::signbit(wrapped(miss(middle))) == std::signbit(wrapped(miss(low))) ? low : high) = middle;
    }
    const double h = std::sin(0.5 * (low + high));
    const auto passes = static_cast<double>(p);
    const double slope = 2.0 * passes / std::sqrt(index * index - h * h) - 2.0 / std::sqrt(1.0 - h * h);
    sum += lobe_shares({fibre.index, theta_diff, h, fibre.absorption})[p] / (2.0 * std::abs(slope));
  }
  return sum;
}

Caustic trt_caustic(double index_in_section) {
  const double c = std::asin(1.0 / index_in_section);
  const double bend = 12.0 * c / std::numbers::pi - 2.0;
  if (bend <= 0.0) return {};
  Caustic caustic;
  caustic.exists = true;
  caustic.gamma = std::sqrt(bend / (48.0 * c / (std::numbers::pi * std::numbers::pi * std::numbers::pi)));
  caustic.h = std::sin(caustic.gamma);
  caustic.phi = wrapped(cubic_exit(2, index_in_section, caustic.gamma));
  return caustic;
}

Ways azimuthal_trt_ways(const SmoothFibre& fibre, double theta_diff, double phi) {
  const CausticTerms& terms = fibre.caustic;
  const double index = bravais_indices(fibre.index, theta_diff).perpendicular;
  const Caustic caustic = trt_caustic(index);
  double part = 1.0, width_h = terms.max_width_h;
  if (caustic.exists) {
    // Second derivative by h where the first is zero.
    const double c = std::asin(1.0 / index);
    const double bend = 96.0 * c / (std::numbers::pi * std::numbers::pi * std::numbers::pi) * caustic.gamma /
                        (1.0 - caustic.h * caustic.h);
    width_h = std::min(width_h, 2.0 * std::sqrt(2.0 * terms.width / bend));
  } else {
    part = 1.0 - smooth_step(2.0, 2.0 + terms.fade, index);
  }
  const double peak = gaussian(terms.width, 0.0);
  const double left = gaussian(terms.width, wrapped(phi - caustic.phi));
  const double right = gaussian(terms.width, wrapped(phi + caustic.phi));
  const double kept = (1.0 - part * left / peak) * (1.0 - part * right / peak);
  // On the caustic the plain term is infinite and nothing of it is kept.
  Ways ways;
  if (kept > 0.0) ways = azimuthal_ways(2, fibre, theta_diff, phi);
  for (Way& way : ways) way.strength *= kept;
  ways.push_back(way_at(2, fibre, theta_diff, caustic.h, part * terms.power * width_h * (left + right)));
  return ways;
}

double azimuthal_trt(const SmoothFibre& fibre, double theta_diff, double phi) {
  return sum_of(azimuthal_trt_ways(fibre, theta_diff, phi), fibre.absorption);
}

double elliptic_index(double index, double eccentricity, double phi_half) {
  const double squared = eccentricity * eccentricity;
  const double first = 2.0 * (index - 1.0) * squared - index + 2.0;
  const double second = 2.0 * (index - 1.0) / squared - index + 2.0;
  return 0.5 * ((first + second) + std::cos(2.0 * phi_half) * (first - second));
}

std::array<double, 3> marschner_lobes(const SmoothFibre& fibre, const std::array<LobeShape, 3>& shapes,
                                      double theta_in, double theta_out, double phi) {
  const double half = 0.5 * (theta_in + theta_out);
  const double diff = 0.5 * (theta_out - theta_in);
  const double cos_diff = std::max(std::cos(diff), kMinCosine);
  const std::array<double, 3> across{azimuthal(0, fibre, diff, phi), azimuthal(1, fibre, diff, phi),
                                     azimuthal_trt(fibre, diff, phi)};
  std::array<double, 3> lobes{};
  for (size_t p = 0; p < lobes.size(); ++p)
    lobes[p] = longitudinal(shapes[p], half) * across[p] * std::cos(theta_in) / (cos_diff * cos_diff);
  return lobes;
}

}  // namespace strandcast::scatter
