// Period, damping and growth out of a sequence of displacements sampled at equal times. Pure functions.
#pragma once

#include <complex>
#include <vector>

namespace strandcast {

/// Time between the first and the last downward zero crossing over the number of swings between, with linear
/// interpolation; NaN with fewer than two crossings.
double swing_period_s(const std::vector<double>& q, double sample_s);

/// The root z, Im z >= 0, of q(k+1) = 2 Re(z) q(k) - |z|^2 q(k-1) that fits the sequence best.
std::complex<double> swing_root(const std::vector<double>& q);

/// The rate s in q'' = s q that fits best: minus the squared frequency, or positive where q grows.
double swing_growth_per_s2(const std::vector<double>& q, double sample_s);

}  // namespace strandcast
