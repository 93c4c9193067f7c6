// Fixture that walks the solver table: every row on every executor and as its double-precision reference.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "server/sim/solver_registry.h"
#include "tests/support/sim_devices.h"
#include "tests/support/sim_scene.h"
#include "tests/support/test_grid.h"

namespace strandcast {

/// One way to make a solver of one row.
struct SolverKind {
  const SolverRow* row = nullptr;
  SolverHost host;
  std::string name() const { return row->name + " (" + host.name() + ")"; }
};

class SolverTest : public testing::Test {
 protected:
  /// On every executor, then as its reference.
  static std::vector<SolverKind> kinds_of(const SolverRow& row) {
    std::vector<SolverKind> kinds;
    if (row.has_kernel)
      for (const SimDevice device : sim_devices()) kinds.push_back({&row, {device}});
    kinds.push_back({&row, kReferenceHost});
    return kinds;
  }
  /// Whether OpenGL's software device, which takes most of the time, walks a row's laws: on the small grid
  /// the rows that scenes have by default. It is held to every row's reference by parity.
  static bool is_walked_by_gl(const SolverRow& row) {
    return test_grid() == TestGrid::Whole || row.name == "dftl" || row.name == "direct_rod";
  }
  static std::vector<SolverKind> all_kinds() {
    std::vector<SolverKind> kinds;
    for (const SolverRow& row : solver_table())
      for (const SolverKind& kind : kinds_of(row))
        if (kind.host.device != SimDevice::Gl || is_walked_by_gl(row)) kinds.push_back(kind);
    return kinds;
  }

  /// Those that a long test walks: on the small grid without OpenGL.
  static std::vector<SolverKind> kinds_of_long_tests() {
    std::vector<SolverKind> kinds = all_kinds();
    if (test_grid() == TestGrid::Small)
      std::erase_if(kinds, [](const SolverKind& kind) { return kind.host.device == SimDevice::Gl; });
    return kinds;
  }

  /// What a long test of one row runs on: lanes on the small grid, for the same reason.
  static SolverKind kind_of_long_test(const SolverRow& row) {
    const std::vector<SolverKind> kinds = kinds_of(row);
    return row.has_kernel && test_grid() == TestGrid::Small ? kinds[1] : kinds.front();
  }

  /// Hair for laws that every strand keeps by itself: in double, on one thread, more of it takes most of the
  /// time.
  static Groom make_law_groom(TestGroomDesc desc = {}) {
    desc.strand_count = static_cast<uint32_t>(on_grid(7, 21));
    return make_test_groom(desc);
  }

  /// A loaded solver; `given` holds what differs from the defaults, as far as the row knows it.
  std::unique_ptr<Solver> make(const SolverKind& kind, const Groom& groom, const SolverParameters& given = {},
                               const glm::dquat& world_from_head_rotation = {1.0, 0.0, 0.0, 0.0},
                               const SceneFeatures& features = all_features()) {
    const auto parameters = complete_parameters(*kind.row, known_parameters(*kind.row, given));
    EXPECT_TRUE(parameters) << parameters.error().to_string();
    std::unique_ptr<Solver> solver;
    if (kind.host.is_kernel()) {
      auto made = kind.row->make(*parameters, {&executors_.on(*kind.host.device), features});
      EXPECT_TRUE(made) << made.error().to_string();
      solver = std::move(made).value();
    } else {
      solver = kind.row->make_reference(*parameters);
    }
    const Status loaded = solver->load(groom, world_from_head_rotation);
    EXPECT_TRUE(loaded) << loaded.error().to_string();
    return solver;
  }

  static SolverState read(Solver& solver) {
    SolverState state;
    solver.read(state);
    return state;
  }

  SimExecutors executors_;
};

/// No gravity, no wind, no motion.
inline StepInput calm_input(double h_s = 1.0 / 60.0) {
  StepInput input;
  input.h_s = h_s;
  input.gravity_mps2 = glm::dvec3(0.0);
  return input;
}

inline bool is_finite(const SolverState& state) {
  for (const auto* values : {&state.position_m, &state.velocity_mps}) {
    for (const glm::vec3& value : *values) {
      if (!std::isfinite(value.x) || !std::isfinite(value.y) || !std::isfinite(value.z)) return false;
    }
  }
  return true;
}

/// Largest excess of |length - rest length| over `relative` times the rest length plus what float positions
/// allow.
inline double length_excess_m(const Groom& groom, const SolverState& state, double relative) {
  constexpr double kFloatStep = 6e-8;
  const uint32_t strand_count = groom.strand_count();
  double worst = -1.0;
  for (uint32_t s = 0; s < strand_count; ++s) {
    const glm::vec3* rest = groom.rest_position_m.data() + groom.offset[s];
    for (uint32_t i = 1; i < groom.vertex_count(s); ++i) {
      const glm::dvec3 a(state.position_m[(i - 1) * strand_count + s]);
      const glm::dvec3 b(state.position_m[i * strand_count + s]);
      const double rest_m = glm::distance(glm::dvec3(rest[i]), glm::dvec3(rest[i - 1]));
      const double rounding_m = 4.0 * kFloatStep * (glm::length(a) + glm::length(b));
      worst = std::fmax(worst, std::abs(glm::distance(a, b) - rest_m) - relative * rest_m - rounding_m);
    }
  }
  return worst;
}

/// Largest relative change of a segment's length; segments below a micrometre are left out.
inline double largest_stretch(const Groom& groom, const SolverState& state) {
  constexpr double kShortestM = 1e-6;
  const uint32_t strand_count = groom.strand_count();
  double largest = 0.0;
  for (uint32_t s = 0; s < strand_count; ++s) {
    const glm::vec3* rest = groom.rest_position_m.data() + groom.offset[s];
    for (uint32_t i = 1; i < groom.vertex_count(s); ++i) {
      const double rest_m = glm::distance(glm::dvec3(rest[i]), glm::dvec3(rest[i - 1]));
      if (rest_m < kShortestM) continue;
      const double now_m = glm::distance(glm::dvec3(state.position_m[(i - 1) * strand_count + s]),
                                         glm::dvec3(state.position_m[i * strand_count + s]));
      largest = std::fmax(largest, std::abs(now_m / rest_m - 1.0));
    }
  }
  return largest;
}

}  // namespace strandcast
