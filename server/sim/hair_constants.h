// HairConstants: material and geometry of a real hair in SI units, and the stiffnesses that follow from them.
// Plain data.
#pragma once
#include <numbers>

namespace strandcast {

/// A straight fibre with a circular cross-section. Defaults: the reference hair of the analytic tests in
/// Daviet, Interactive Hair Simulation on the GPU using ADMM, SIGGRAPH 2023.
struct HairConstants {
  double radius_m = 5e-5;
  double density_kgpm3 = 1300.0;
  double young_modulus_pa = 3e9;
  double poisson_ratio = 0.45;

  double area_m2() const { return std::numbers::pi * radius_m * radius_m; }
  double linear_density_kgpm() const { return density_kgpm3 * area_m2(); }
  double shear_modulus_pa() const { return young_modulus_pa / (2.0 * (1.0 + poisson_ratio)); }
  /// Stretching stiffness E A: force per relative stretch, N.
  double stretch_stiffness_n() const { return young_modulus_pa * area_m2(); }
  /// Bending stiffness E I: moment per curvature, N m^2.
  double bending_stiffness_nm2() const { return young_modulus_pa * 0.25 * area_m2() * radius_m * radius_m; }
  /// Twisting stiffness G J: moment per twist, N m^2.
  double twist_stiffness_nm2() const { return shear_modulus_pa() * 0.5 * area_m2() * radius_m * radius_m; }
};

}  // namespace strandcast
