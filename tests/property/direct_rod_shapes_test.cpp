// direct_rod at rest against the shapes of rods and chains: end load, end moment, catenary, buckling, and how
// fast the discrete shape converges.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "tests/property/direct_rod_fixture.h"
#include "tests/support/claims.h"
#include "tests/support/shared_data.h"

namespace strandcast::direct_rod_shapes_test {
namespace {

constexpr double kRateHz = 60.0;

class RodShapes : public DirectRod {
 protected:
  /// A bead of so many hairs' weight makes the hair's own weight a load of a thousandth.
  static constexpr double kBeadPerHair = 1000.0;

  /// A horizontal strand after it came to rest, b = EI / (rho A).
  SolverState settled(const SolverHost& host, uint32_t vertex_count, double b_m4ps2,
                      SolverParameters parameters) {
    parameters["young_modulus_pa"] = modulus_for(b_m4ps2);
    parameters.insert({"air_drag_per_s", 20.0});
    auto rod = make_rod(host, straight_strand(vertex_count, {1.0, 0.0, 0.0}), parameters);
    run(*rod, falling_input(1.0 / kRateHz, {0.0, -kGravityMps2, 0.0}), 12.0);
    return read(*rod);
  }

  SolverState under_end_load(const SolverHost& host, uint32_t vertex_count, double alpha) {
    const double b = kBeadPerHair * kGravityMps2 * std::pow(kLengthM, 3) / alpha;
    return settled(host, vertex_count, b, {{"tip_mass_kg", kBeadPerHair * kMassPerLengthKgpm * kLengthM}});
  }

  SolverState under_own_weight(const SolverHost& host, uint32_t vertex_count, double gamma) {
    return settled(host, vertex_count, kGravityMps2 * std::pow(kLengthM, 3) / gamma, {});
  }

  static void run(Solver& rod, const StepInput& input, double time_s) {
    for (int step = 0; step < time_s / input.h_s; ++step) rod.substep(input);
  }
};

struct TipOfLoad {
  double alpha;  // P L^2 / EI
  double x;      // over the length
  double y;
};

// Elastica under an end load: EI theta'' = -P cos(theta), theta(0) = 0, theta'(L) = 0.
TEST_F(RodShapes, AnEndLoadBendsAsTheElastica) {
  const std::vector<TipOfLoad> tips = {{0.5, 0.984081, 0.162144}, {1.0, 0.943567, 0.301721},
                                       {2.0, 0.839358, 0.493457}, {3.0, 0.745580, 0.603253},
                                       {5.0, 0.612372, 0.713792}, {10.0, 0.445004, 0.810609}};
  for (const SolverHost& host : solver_hosts()) {
    for (const TipOfLoad& tip : tips) {
      SCOPED_TRACE(fmt::format("{}, load {}", host.name(), tip.alpha));
      const glm::dvec3 got =
          glm::dvec3(under_end_load(host, claims::kRodVertices, tip.alpha).position_m.back()) / kLengthM;
      const double off = std::hypot(got.x - tip.x, got.y + tip.y);
      EXPECT_LE(off, claims::kEndLoadTip);
      fmt::print("{}, load {}: tip off by {:.3f} % of the length\n", host.name(), tip.alpha, 100.0 * off);
    }
  }
}

/// Rows of a table of shapes that belong to one parameter: arc length, x, y, all over the length.
std::vector<glm::dvec3> shape_of(const std::filesystem::path& path, double parameter) {
  std::ifstream file(path);
  std::string line;
  std::vector<glm::dvec3> points;
  while (std::getline(file, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream words(line);
    double key = 0.0;
    glm::dvec3 point(0.0);
    if (words >> key >> point.x >> point.y >> point.z && std::abs(key - parameter) < 1e-9)
      points.push_back(point);
  }
  return points;
}

/// Largest distance of a vertex from the curve's point at its arc length, over the length.
double away_from(const std::vector<glm::dvec3>& shape, const std::vector<glm::vec3>& position,
                 double length_m) {
  double largest = 0.0;
  for (size_t i = 0; i < position.size(); ++i) {
    const double s = static_cast<double>(i) / static_cast<double>(position.size() - 1);
    const double at = s * static_cast<double>(shape.size() - 1);
    const size_t k = std::min(static_cast<size_t>(at), shape.size() - 2);
    const glm::dvec3 point = glm::mix(shape[k], shape[k + 1], at - static_cast<double>(k));
    const glm::dvec3 got = glm::dvec3(position[i]) / length_m;
    largest = std::max(largest, std::hypot(got.x - point.y, got.y - point.z));
  }
  return largest;
}

TEST_F(RodShapes, EveryVertexLiesOnTheExactCurve) {
  const auto folder = std::filesystem::path(STRANDCAST_SHARED_DATA) / "analytic";
  REQUIRE_SHARED(folder);
  for (const double alpha : {1.0, 5.0, 10.0}) {
    const auto shape = shape_of(folder / "cantilever_end_load.csv", alpha);
    ASSERT_EQ(shape.size(), 101u);
    for (const SolverHost& host : kernel_hosts()) {
      const double away = away_from(shape, under_end_load(host, 26, alpha).position_m, kLengthM);
      EXPECT_LE(away, 0.0015) << "load " << alpha << ", " << host.name();
      fmt::print("{}, load {}: {:.3f} %\n", host.name(), alpha, 100.0 * away);
    }
  }
  for (const double gamma : {1.0, 10.0, 100.0}) {
    const auto shape = shape_of(folder / "cantilever_self_weight.csv", gamma);
    ASSERT_EQ(shape.size(), 101u);
    for (const SolverHost& host : kernel_hosts()) {
      const double away = away_from(shape, under_own_weight(host, 26, gamma).position_m, kLengthM);
      EXPECT_LE(away, 0.0015) << "Gamma " << gamma << ", " << host.name();
      fmt::print("{}, Gamma {}: {:.3f} %\n", host.name(), gamma, 100.0 * away);
    }
  }
}

// An end moment of 2 pi EI / L is a curvature of 2 pi / L all along, which a rod may as well have by nature:
// straight at first, it rolls itself into a closed ring.
TEST_F(RodShapes, AnEndMomentRollsTheRodIntoARing) {
  constexpr uint32_t kVertexCount = 33;
  std::vector<glm::vec3> ring;
  const double side_m = kLengthM / (kVertexCount - 1);
  glm::dvec3 point(0.0);
  for (uint32_t i = 0; i < kVertexCount; ++i) {
    ring.emplace_back(point);
    const double angle = 2.0 * std::numbers::pi * i / (kVertexCount - 1);
    point += side_m * glm::dvec3(std::cos(angle), std::sin(angle), 0.0);
  }
  for (const SolverHost& host : solver_hosts()) {
    auto rod = make_rod(host, groom_from({ring}, Pinning::Root), {{"air_drag_per_s", 2.0}});
    SolverState state = read(*rod);
    for (uint32_t i = 0; i < kVertexCount; ++i) state.position_m[i] = glm::vec3(side_m * i, 0.0, 0.0);
    rod->write(state);
    run(*rod, calm_input(1.0 / kRateHz), 16.0);
    const std::vector<glm::vec3> position = read(*rod).position_m;
    const double gap = static_cast<double>(glm::distance(position.back(), position.front())) / kLengthM;
    EXPECT_LE(gap, 1e-4);
    fmt::print("{}: the ends meet within {:.1e} of the length\n", host.name(), gap);
  }
}

struct Catenary {
  double span;  // over the length
  double sag;
};

TEST_F(RodShapes, AChainHeldAtBothEndsHangsAsTheCatenary) {
  const std::vector<Catenary> cases = {{0.25, 0.463166}, {0.5, 0.398194}, {0.75, 0.294334}, {0.9, 0.190709}};
  constexpr uint32_t kVertexCount = 33;  // one in the middle
  for (const SolverHost& host : solver_hosts()) {
    for (const Catenary& test : cases) {
      SCOPED_TRACE(fmt::format("{}, span {}", host.name(), test.span));
      // Groomed as a V.
      std::vector<glm::vec3> strand;
      const double depth = 0.5 * std::sqrt(1.0 - test.span * test.span);
      for (uint32_t i = 0; i < kVertexCount; ++i) {
        const double s = static_cast<double>(i) / (kVertexCount - 1);
        strand.emplace_back(kLengthM * test.span * s, -kLengthM * depth * (1.0 - std::abs(2.0 * s - 1.0)),
                            0.0);
      }
      Groom groom = groom_from({strand}, Pinning::Root);
      groom.pinned.back() = 1;
      auto rod = make_rod(host, groom, {{"young_modulus_pa", 0.0}, {"air_drag_per_s", 20.0}});
      run(*rod, falling_input(1.0 / kRateHz, {0.0, -kGravityMps2, 0.0}), 10.0);
      const double sag = -static_cast<double>(read(*rod).position_m[kVertexCount / 2].y) / kLengthM;
      EXPECT_NEAR(sag, test.sag, 0.0012);
      fmt::print("{}, span {}: sag {:+.3f} % of the length\n", host.name(), test.span,
                 100.0 * (sag - test.sag));
    }
  }
}

// Greenhill: an upright rod stays up below Gamma = 7.83735 and falls above.
TEST_F(RodShapes, AnUprightRodBucklesAtGreenhillsLength) {
  constexpr double kCritical = 7.83735;
  for (const SolverHost& host : solver_hosts()) {
    for (const double share : {0.9, 1.0 - claims::kBuckling, 1.0 + claims::kBuckling, 1.1}) {
      SCOPED_TRACE(fmt::format("{}, {} of the critical load", host.name(), share));
      const double b = kGravityMps2 * std::pow(kLengthM, 3) / (share * kCritical);
      auto rod = make_rod(host, straight_strand(32, {0.0, 1.0, 0.0}),
                          {{"young_modulus_pa", modulus_for(b)}, {"air_drag_per_s", 1.0}});
      run(*rod, falling_input(1.0 / kRateHz, {0.02, -kGravityMps2, 0.0}), 0.2);
      run(*rod, falling_input(1.0 / kRateHz, {0.0, -kGravityMps2, 0.0}), 40.0);
      const double aside = static_cast<double>(read(*rod).position_m.back().x) / kLengthM;
      if (share < 1.0) {
        EXPECT_LE(std::abs(aside), 1e-3);
      } else {
        EXPECT_GE(std::abs(aside), 0.1);
      }
      fmt::print("{}, {} of the critical load: {:+.1e} of the length aside\n", host.name(), share, aside);
    }
  }
}

TEST_F(RodShapes, SpaceDiscretisationIsOfSecondOrder) {
  // Tip of the exact curve at Gamma = 1.
  const glm::dvec3 exact(0.991246, -0.123471, 0.0);
  std::vector<double> error;
  for (const uint32_t vertex_count : {9u, 17u, 33u}) {
    const SolverState state = under_own_weight(kReferenceHost, vertex_count, 1.0);
    error.push_back(glm::distance(glm::dvec3(state.position_m.back()) / kLengthM, exact));
  }
  for (size_t k = 0; k + 1 < error.size(); ++k) {
    const double order = std::log2(error[k] / error[k + 1]);
    EXPECT_NEAR(order, 2.0, 0.25);
    fmt::print("tip error {:.2e} to {:.2e} of the length with half the edges: order {:.2f}\n", error[k],
               error[k + 1], order);
  }
}

}  // namespace
}  // namespace strandcast::direct_rod_shapes_test
