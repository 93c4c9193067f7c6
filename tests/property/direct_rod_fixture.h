// What the tests of direct_rod share: its two versions on strands of 0.3 m with a hair's cross section.
#pragma once

#include <cmath>
#include <numbers>
#include <string>

#include "tests/support/solver_fixture.h"

namespace strandcast {

class DirectRod : public SolverTest {
 protected:
  static constexpr double kLengthM = 0.3;
  static constexpr double kGravityMps2 = 9.81;
  static constexpr double kRadiusM = 5e-5;
  static constexpr double kDensityKgpm3 = 1300.0;
  static constexpr double kHairModulusPa = 3e9;
  static constexpr double kMassPerLengthKgpm = kDensityKgpm3 * std::numbers::pi * kRadiusM * kRadiusM;

  static SolverKind kind(const SolverHost& host) { return {*find_solver("direct_rod"), host}; }

  std::unique_ptr<Solver> make_rod(const SolverHost& host, const Groom& groom,
                                   const SolverParameters& given) {
    return make(kind(host), groom, given);
  }

  /// Young's modulus with which a hair of the default radius and density has EI / (rho A) = b.
  static double modulus_for(double b_m4ps2) { return b_m4ps2 * 4.0 * kDensityKgpm3 / (kRadiusM * kRadiusM); }

  /// One straight strand from the head joint, clamped at its first vertex.
  static Groom straight_strand(uint32_t vertex_count, const glm::dvec3& direction,
                               double length_m = kLengthM) {
    std::vector<glm::vec3> strand;
    for (uint32_t i = 0; i < vertex_count; ++i)
      strand.emplace_back(direction * (length_m * i / (vertex_count - 1)));
    return groom_from({strand}, Pinning::Root);
  }

  static StepInput falling_input(double h_s, const glm::dvec3& gravity_mps2) {
    StepInput input = calm_input(h_s);
    input.gravity_mps2 = gravity_mps2;
    return input;
  }
};

}  // namespace strandcast
