#include "server/report/swing_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace strandcast {

double swing_period_s(const std::vector<double>& q, double sample_s) {
  std::vector<double> crossing_s;
  for (size_t k = 1; k < q.size(); ++k) {
    if (q[k - 1] > 0.0 && q[k] <= 0.0)
      crossing_s.push_back((static_cast<double>(k) - 1.0 + q[k - 1] / (q[k - 1] - q[k])) * sample_s);
  }
  if (crossing_s.size() < 2) return std::numeric_limits<double>::quiet_NaN();
  return (crossing_s.back() - crossing_s.front()) / static_cast<double>(crossing_s.size() - 1);
}

std::complex<double> swing_root(const std::vector<double>& q) {
  double s11 = 0.0, s12 = 0.0, s22 = 0.0, r1 = 0.0, r2 = 0.0;
  for (size_t k = 1; k + 1 < q.size(); ++k) {
    s11 += q[k] * q[k];
    s12 += q[k] * q[k - 1];
    s22 += q[k - 1] * q[k - 1];
    r1 += q[k] * q[k + 1];
    r2 += q[k - 1] * q[k + 1];
  }
  const double determinant = s11 * s22 - s12 * s12;
  const double a = (r1 * s22 - r2 * s12) / determinant;
  const double c = -(r2 * s11 - r1 * s12) / determinant;
  return {0.5 * a, std::sqrt(std::max(0.0, c - 0.25 * a * a))};
}

double swing_growth_per_s2(const std::vector<double>& q, double sample_s) {
  double along = 0.0;
  double square = 0.0;
  for (size_t k = 1; k + 1 < q.size(); ++k) {
    along += q[k] * (q[k + 1] - 2.0 * q[k] + q[k - 1]);
    square += q[k] * q[k];
  }
  return along / square / (sample_s * sample_s);
}

}  // namespace strandcast
