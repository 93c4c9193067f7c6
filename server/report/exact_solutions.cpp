#include "server/report/exact_solutions.h"

#include <array>
#include <cmath>

namespace strandcast {
namespace {

constexpr std::array kBesselRoots = {2.404825557695773, 5.520078110286311, 8.653727912911013};
constexpr double kBeamBeta = 1.8751040687119611;
// (cosh(beta) + cos(beta)) / (sinh(beta) + sin(beta))
constexpr double kBeamSigma = 0.7340955137589128;

double bessel_root(int mode) {
  return kBesselRoots[static_cast<size_t>(mode - 1)];
}

}  // namespace

std::span<const EndLoadTip> end_load_tips() {
  static constexpr std::array kTips = {
      EndLoadTip{0.5, 0.984081, 0.162144}, EndLoadTip{1.0, 0.943567, 0.301721},
      EndLoadTip{2.0, 0.839358, 0.493457}, EndLoadTip{3.0, 0.745580, 0.603253},
      EndLoadTip{5.0, 0.612372, 0.713792}, EndLoadTip{10.0, 0.445004, 0.810609}};
  return kTips;
}

std::span<const CantileverShape> cantilever_shapes() {
  static constexpr std::array kShapes = {
      CantileverShape{0.01, 0.999999, 0.001250},  CantileverShape{0.1, 0.999911, 0.012498},
      CantileverShape{0.5, 0.997779, 0.062306},   CantileverShape{1.0, 0.991246, 0.123471},
      CantileverShape{2.0, 0.966893, 0.238507},   CantileverShape{3.0, 0.931511, 0.339648},
      CantileverShape{5.0, 0.846657, 0.495905},   CantileverShape{8.0, 0.724425, 0.640631},
      CantileverShape{10.0, 0.656354, 0.700200},  CantileverShape{20.0, 0.445232, 0.829881},
      CantileverShape{50.0, 0.245015, 0.907917},  CantileverShape{100.0, 0.159223, 0.937524},
      CantileverShape{200.0, 0.107420, 0.956769}, CantileverShape{500.0, 0.065890, 0.973117},
      CantileverShape{1000.0, 0.045986, 0.981141}};
  return kShapes;
}

double chain_frequency_radps(double length_m, double gravity_mps2, int mode) {
  return 0.5 * bessel_root(mode) * std::sqrt(gravity_mps2 / length_m);
}

double chain_mode(double s, int mode) {
  return std::cyl_bessel_j(0.0, bessel_root(mode) * std::sqrt(std::max(0.0, 1.0 - s)));
}

double beam_frequency_radps(double length_m, double b_m4ps2) {
  return kBeamBetaSquared * std::sqrt(b_m4ps2) / (length_m * length_m);
}

double beam_mode(double s) {
  const double x = kBeamBeta * s;
  return std::cosh(x) - std::cos(x) - kBeamSigma * (std::sinh(x) - std::sin(x));
}

double catenary_sag(double span) {
  // u = d / 2a solves sinh(u) / u = L / d; the sag is a (cosh(u) - 1).
  double low = 0.0;
  double high = 1.0;
  while (std::sinh(high) / high < 1.0 / span) high *= 2.0;
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    (std::sinh(middle) / middle < 1.0 / span ? low : high) = middle;
  }
  return 0.5 * span / low * (std::cosh(low) - 1.0);
}

glm::dvec2 tractrix_end(double way) {
  return {way - std::tanh(way), 1.0 / std::cosh(way)};
}

std::complex<double> implicit_step_root(int order, double omega_h) {
  const std::complex<double> turn(0.0, omega_h);
  if (order < 2) return 1.0 / (1.0 - turn);
  return (2.0 + std::sqrt(1.0 + 2.0 * turn)) / (3.0 - 2.0 * turn);
}

double damping_per_radian(const std::complex<double>& root) {
  return std::log(std::abs(root)) / std::arg(root);
}

}  // namespace strandcast
