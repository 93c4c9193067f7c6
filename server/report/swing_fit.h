// Estimates period, damping and growth from displacements sampled at equal intervals. Pure functions.
#pragma once

#include <complex>
#include <vector>

namespace strandcast {

/// Returns the mean time between downward zero crossings, with linear interpolation; NaN with fewer than two.
double swing_period_s(const std::vector<double>& q, double sample_s);

/// Returns the root z, Im z >= 0, of the recurrence q(k+1) = 2 Re(z) q(k) - |z|^2 q(k-1) that best fits the
/// sequence.
std::complex<double> swing_root(const std::vector<double>& q);

/// Returns the rate s that best fits q'' = s q: minus the squared frequency, or positive if q grows.
double swing_growth_per_s2(const std::vector<double>& q, double sample_s);

}  // namespace strandcast
