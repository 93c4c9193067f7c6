// Theory of clamped rods and hanging chains: exact values against which work-precision measures strand
// models. Closed forms where they exist, otherwise tables from boundary-value solutions (tolerance 1e-10).
// Pure functions, any thread.
#pragma once

#include <complex>
#include <glm/glm.hpp>
#include <span>

namespace strandcast {

/// A horizontal clamped rod under its own weight (elastica of a heavy rod): EI theta'' = -w (L - s)
/// cos(theta), theta(0) = 0, theta'(L) = 0, gamma = w L^3 / EI; y downwards.
struct CantileverShape {
  double gamma = 0.0;
  double x = 0.0;  // of the tip over the length
  double y = 0.0;

  double height_over_width() const { return y / x; }
};
/// Returns the shapes, ascending in gamma, 0.01 to 1000.
std::span<const CantileverShape> cantilever_shapes();

/// Tip of a horizontal clamped weightless rod with a load P at its end: EI theta'' = -P cos(theta), theta(0)
/// = 0, theta'(L) = 0, alpha = P L^2 / EI; y downwards, relative to the length.
struct EndLoadTip {
  double alpha = 0.0;
  double x = 0.0;
  double y = 0.0;
};
/// Returns the tips, ascending in alpha, 0.5 to 10.
std::span<const EndLoadTip> end_load_tips();

/// Angular frequency (rad/s) of mode 1, 2 or 3 of a hanging chain: (j / 2) sqrt(g / L), j a root of the
/// Bessel function J0 (Daniel Bernoulli).
double chain_frequency_radps(double length_m, double gravity_mps2, int mode);
/// Displacement of that mode at s = 0 (fixed end) .. 1: J0(j sqrt(1 - s)).
double chain_mode(double s, int mode);

/// Angular frequency (rad/s) of the first mode of a clamped free beam: beta^2 sqrt(b / L^4), b = EI / (rho
/// A), cos(beta) cosh(beta) = -1.
double beam_frequency_radps(double length_m, double b_m4ps2);
double beam_mode(double s);
/// First maximum of the tip relative to its static deflection, after a small load is applied suddenly without
/// damping. It follows from the modes' shares 1.01339, -0.01430, 0.00107 of the static deflection and their
/// frequencies.
inline constexpr double kBeamFirstSwing = 2.0253;
inline constexpr double kBeamBetaSquared = 3.516015;

/// Sag of the middle, relative to the length, of a chain hung from two points at equal height `span` lengths
/// apart: L = 2 a sinh(d / 2 a).
double catenary_sag(double span);

/// End of a taut string, relative to its length, after its head was dragged `way` lengths along x from (0,
/// 0); the end starts at (0, 1): (way - tanh(way), sech(way)).
glm::dvec2 tractrix_end(double way);

/// Smallest gamma at which an upright rod buckles under its weight: 9/4 of the squared first root of J_(-1/3)
/// (Greenhill 1881).
inline constexpr double kBucklingGamma = 7.83735;

/// Factor by which one step of x'' = -omega^2 x multiplies a solution. Order 1 is backward Euler, 1 / (1 - i
/// omega h); order 2 is backward differences, (2 + sqrt(1 + 2 i omega h)) / (3 - 2 i omega h).
std::complex<double> implicit_step_root(int order, double omega_h);
/// Damping per radian of the oscillation, ln |z| / arg z; comparable between step sizes.
double damping_per_radian(const std::complex<double>& root);

}  // namespace strandcast
