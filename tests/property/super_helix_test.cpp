// super_helix: the line's derivatives, what it takes from a groom, and the mechanics of rods and springs with
// few elements.
#include <algorithm>
#include <numbers>

#include "server/sim/solvers/super_helix/helix_shape.h"
#include "tests/support/solver_fixture.h"

namespace strandcast::super_helix_test {
namespace {

constexpr double kLengthM = 0.3;
constexpr double kGravityMps2 = 9.81;

// ---- the line ----

/// A helix about -y: `pitch_m` down per turn.
std::vector<glm::dvec3> helix_points(double radius_m, double pitch_m, double turns, uint32_t vertex_count) {
  std::vector<glm::dvec3> points;
  for (uint32_t i = 0; i < vertex_count; ++i) {
    const double turn = turns * i / (vertex_count - 1);
    const double angle = 2.0 * std::numbers::pi * turn;
    points.emplace_back(radius_m * std::cos(angle), -pitch_m * turn, radius_m * std::sin(angle));
  }
  return points;
}

/// Springs from every vertex to a point of its own.
HelixEnergy springs(std::vector<glm::dvec3> anchors) {
  return [anchors = std::move(anchors)](const HelixShape& shape, std::vector<VertexEnergy>* derivatives) {
    double energy = 0.0;
    for (size_t i = 0; i < anchors.size(); ++i) {
      const double stiffness = 1.0 + 0.1 * static_cast<double>(i);
      const glm::dvec3 off = shape.vertex_m[i] - anchors[i];
      energy += 0.5 * stiffness * glm::dot(off, off);
      if (derivatives != nullptr) (*derivatives)[i] = {stiffness * off, glm::dmat3(stiffness)};
    }
    return energy;
  };
}

TEST(HelixShape, DerivativesAreThoseOfTheEnergy) {
  const std::vector<glm::dvec3> points = helix_points(0.04, 0.1, 0.8, 13);
  const HelixLine line = make_helix_line(points, 3);
  std::vector<glm::dvec3> anchors;
  for (size_t i = 1; i < points.size(); ++i)
    anchors.push_back(points[i] + glm::dvec3(0.05, 0.02 * static_cast<double>(i), -0.03));
  const HelixEnergy energy = springs(anchors);
  std::vector<glm::dvec3> q = line.natural;
  q[1] += glm::dvec3(2.0, -1.0, 3.0);
  const auto value_at = [&](const std::vector<glm::dvec3>& at) {
    return energy(make_helix_shape(line, at, points[0], line.clamp), nullptr);
  };
  std::vector<VertexEnergy> per_vertex(anchors.size());
  const HelixShape shape = make_helix_shape(line, q, points[0], line.clamp);
  energy(shape, &per_vertex);
  const HelixDerivatives derivatives = make_helix_derivatives(line, shape, per_vertex);
  constexpr double kStep = 1e-2;  // 1/m; the energy is smooth over metres of that
  const size_t size = derivatives.gradient.size();
  ASSERT_EQ(size, 9u);
  double largest = 0.0;
  for (const double value : derivatives.matrix) largest = std::max(largest, std::abs(value));
  const auto moved = [&q](size_t i, double a, size_t j, double b) {
    std::vector<glm::dvec3> result = q;
    result[i / 3][static_cast<int>(i % 3)] += a;
    result[j / 3][static_cast<int>(j % 3)] += b;
    return result;
  };
  for (size_t i = 0; i < size; ++i) {
    const double slope =
        (value_at(moved(i, kStep, i, 0.0)) - value_at(moved(i, -kStep, i, 0.0))) / (2.0 * kStep);
    EXPECT_NEAR(derivatives.gradient[i], slope, 1e-4 * std::abs(slope) + 1e-8) << i;
    for (size_t j = 0; j < size; ++j) {
      const double curvature =
          (value_at(moved(i, kStep, j, kStep)) - value_at(moved(i, kStep, j, -kStep)) -
           value_at(moved(i, -kStep, j, kStep)) + value_at(moved(i, -kStep, j, -kStep))) /
          (4.0 * kStep * kStep);
      // Two points per edge see the turns within one edge only as their mean.
      EXPECT_NEAR(derivatives.matrix[i * size + j], curvature, 1e-2 * largest) << i << ", " << j;
    }
  }
}

// kappa = R / (R^2 + c^2) and torsion c / (R^2 + c^2), c = pitch / (2 pi): one element is enough for a helix.
TEST(HelixShape, AHelixIsOneElement) {
  constexpr double kRadiusM = 0.01;
  constexpr double kPitchM = 0.03;
  const HelixLine line = make_helix_line(helix_points(kRadiusM, kPitchM, 3.0, 64), 1);
  const double c = kPitchM / (2.0 * std::numbers::pi);
  const double squared = kRadiusM * kRadiusM + c * c;
  const glm::dvec3 natural = line.natural[0];
  EXPECT_NEAR(std::hypot(natural.x, natural.y) * squared / kRadiusM, 1.0, 0.02);
  EXPECT_NEAR(std::abs(natural.z) * squared / c, 1.0, 0.02);
  double off_m = 0.0;
  for (const glm::dvec3& offset : line.offset_m) off_m = std::max(off_m, glm::length(offset));
  // The clamp's direction is that of the polygon.
  EXPECT_LE(off_m, 0.1 * kRadiusM);
}

// The groom is kept by the offsets, however few elements there are.
TEST(HelixShape, AnyLineIsKept) {
  std::vector<glm::dvec3> points;
  for (int i = 0; i < 20; ++i)
    points.emplace_back(0.01 * i, 0.02 * std::sin(1.3 * i), 0.015 * std::cos(0.7 * i * i));
  for (const uint32_t elements : {1u, 3u, 16u, 100u}) {
    const HelixLine line = make_helix_line(points, elements);
    const HelixShape shape = make_helix_shape(line, line.natural, points[0], line.clamp);
    for (size_t i = 1; i < points.size(); ++i)
      EXPECT_LE(glm::distance(shape.vertex_m[i - 1], points[i]), 1e-12) << elements << " elements";
  }
}

// ---- the solver ----

Groom straight_strand(uint32_t vertex_count, const glm::dvec3& direction) {
  std::vector<glm::vec3> strand;
  for (uint32_t i = 0; i < vertex_count; ++i)
    strand.emplace_back(direction * (kLengthM * i / (vertex_count - 1)));
  return groom_from({strand}, Pinning::Root);
}

/// Young's modulus with which a hair of the default radius and density has EI / (rho A) = b.
double modulus_for(double b_m4ps2) {
  constexpr double kRadiusM = 5e-5;
  constexpr double kDensityKgpm3 = 1300.0;
  return b_m4ps2 * 4.0 * kDensityKgpm3 / (kRadiusM * kRadiusM);
}

class SuperHelix : public SolverTest {
 protected:
  std::unique_ptr<Solver> make_strand(const Groom& groom, const SolverParameters& given) {
    return make({*find_solver("super_helix"), kReferenceHost}, groom, given);
  }
  /// How far the tip of a horizontal strand of Gamma 10 hangs from where it should, over the length.
  double cantilever_error(double elements) {
    constexpr double kGamma = 10.0;
    constexpr double kTipX = 0.656354;
    constexpr double kTipY = -0.700200;
    const double b = kGravityMps2 * std::pow(kLengthM, 3) / kGamma;
    auto strand = make_strand(straight_strand(32, {1.0, 0.0, 0.0}), {{"young_modulus_pa", modulus_for(b)},
                                                                     {"air_drag_per_s", 20.0},
                                                                     {"style_stiffness_per_s2", 0.0},
                                                                     {"elements", elements}});
    StepInput input;
    input.h_s = 1.0 / 30.0;
    input.gravity_mps2 = {0.0, -kGravityMps2, 0.0};
    for (int step = 0; step < 360; ++step) strand->substep(input);
    const glm::dvec3 tip = glm::dvec3(read(*strand).position_m.back()) / kLengthM;
    return std::hypot(tip.x - kTipX, tip.y - kTipY);
  }
};

// b theta'' = -g (L - s) cos(theta), theta(0) = 0, theta'(L) = 0, Gamma = g L^3 / b = 10.
TEST_F(SuperHelix, AFewElementsHangAsTheExactCurve) {
  double before = 1.0;
  for (const double elements : {1.0, 2.0, 4.0, 8.0}) {
    const double off = cantilever_error(elements);
    fmt::print("{} elements: tip off by {:.3f} % of the length\n", elements, 100.0 * off);
    // Second order: a quarter with twice as many.
    EXPECT_LE(off, 0.2 / (elements * elements));
    if (elements > 1.0) {
      EXPECT_NEAR(before / off, 4.0, 0.8);
    }
    before = off;
  }
}

// A coil of N turns of radius R and small pitch is a spring of k = G r^4 / (4 N R^3), by twist almost alone;
// its own weight stretches it by m g / (2 k).
TEST_F(SuperHelix, ACoilOfFourElementsStretchesAsAHelicalSpring) {
  constexpr double kTurns = 3.0;
  constexpr double kRadiusM = 5e-3;
  constexpr double kPitchM = 5e-4;
  constexpr double kLoadMps2 = 0.2;
  const HairConstants hair;
  std::vector<glm::vec3> strand;
  for (const glm::dvec3& point : helix_points(kRadiusM, kPitchM, kTurns, 64)) strand.emplace_back(point);
  const double wire_m = 2.0 * std::numbers::pi * kRadiusM * kTurns;
  const double spring_npm =
      hair.shear_modulus_pa() * std::pow(hair.radius_m, 4) / (4.0 * kTurns * std::pow(kRadiusM, 3));
  const double expected_m = hair.linear_density_kgpm() * wire_m * kLoadMps2 / (2.0 * spring_npm);
  auto solver = make_strand(groom_from({strand}, Pinning::RootPair),
                            {{"air_drag_per_s", 20.0}, {"style_stiffness_per_s2", 0.0}});
  StepInput input;
  input.gravity_mps2 = {0.0, -kLoadMps2, 0.0};
  for (int step = 0; step < 300; ++step) solver->substep(input);
  const double sunk_m = static_cast<double>(strand.back().y - read(*solver).position_m.back().y);
  fmt::print("the coil sinks by {:.3e} m, a spring by {:.3e} m\n", sunk_m, expected_m);
  EXPECT_NEAR(sunk_m / expected_m, 1.0, 0.05);
}

// Held at a millionth of its give, a strand goes where the head takes it.
TEST_F(SuperHelix, AMillionTimesStifferKeepsTheGroom) {
  const Groom groom = make_test_groom({});
  auto solver = make_strand(groom, {{"young_modulus_pa", 3e15}, {"style_stiffness_per_s2", 0.0}});
  double off_m = 0.0;
  for (int step = 1; step <= 60; ++step) {
    StepInput input = moving_input(step, 1.0 / 60.0);
    input.colliders.clear();
    solver->substep(input);
    const SolverState state = read(*solver);
    ASSERT_TRUE(is_finite(state)) << "step " << step;
    for (uint32_t s = 0; s < groom.strand_count(); ++s) {
      const glm::dvec3 tip(groom.rest_position_m[groom.offset[s + 1] - 1]);
      const size_t at = (groom.vertex_count(s) - 1) * groom.strand_count() + s;
      off_m = std::max(off_m,
                       glm::distance(input.world_from_head_rotation * tip, glm::dvec3(state.position_m[at])));
    }
  }
  EXPECT_LE(off_m, 1e-3);
  fmt::print("tips off the groom by {:.1e} m at most\n", off_m);
}

// An undamped strand let go horizontally never lifts its centre above where it began.
TEST_F(SuperHelix, AnUndampedSwingGainsNoEnergy) {
  auto solver =
      make_strand(straight_strand(16, {1.0, 0.0, 0.0}),
                  {{"air_drag_per_s", 0.0}, {"style_stiffness_per_s2", 0.0}, {"bending_damping_s", 0.0}});
  const StepInput input;
  double lowest_m = 0.0;
  for (int step = 0; step < 180; ++step) {
    solver->substep(input);
    double height_m = 0.0;
    for (const glm::vec3& point : read(*solver).position_m) height_m += static_cast<double>(point.y) / 16.0;
    EXPECT_LE(height_m, 0.0) << "step " << step;
    lowest_m = std::min(lowest_m, height_m);
  }
  EXPECT_LE(lowest_m, -0.1);
}

}  // namespace
}  // namespace strandcast::super_helix_test
