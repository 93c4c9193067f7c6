// Laws of the limit of the roots, for every row of the solver table, on the GPU and in double: no root leans
// further than its follicle lets it, and nothing else changes.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "common/base/quantile.h"
#include "common/math/pose.h"
#include "common/scene/scene_file.h"
#include "server/scene/scene_content.h"
#include "tests/support/claims.h"
#include "tests/support/shared_data.h"
#include "tests/support/solver_bounds.h"
#include "tests/support/solver_fixture.h"
#include "tests/support/some_strands.h"
#include "tests/support/test_grid.h"

namespace strandcast::follicle_limit_test {
namespace {
constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kLimitDeg = claims::kFollicleLimitDeg;
constexpr double kSubstepS = 1.0 / 60.0;
/// A position of 0.3 m is stored to 1.5e-8 m: so much of an angle over a first segment of some millimetres,
/// at both ends, and the angle's own arithmetic.
constexpr double kRoundingDeg = 0.01;
constexpr double kPositionRoundingM = 4 * 3e-8;

const glm::dquat kUpright(1.0, 0.0, 0.0, 0.0);

SceneFeatures held_features() {
  SceneFeatures features = all_features();
  features.has_follicle_limit = true;
  return features;
}

StepInput held(StepInput input, double limit_deg = kLimitDeg) {
  input.follicle_limit_rad = limit_deg * kDegree;
  return input;
}

/// 10 g to and fro at 4 Hz.
Pose shake(double t) {
  const double rate = 2.0 * std::numbers::pi * 4.0;
  return {glm::dvec3(10.0 * 9.80665 / (rate * rate) * std::sin(rate * t), 0.0, 0.0), kUpright};
}
/// To either side by 90 degrees, at 2,600 deg/s in the middle.
Pose turn(double t) {
  const double most = 0.5 * std::numbers::pi;
  return {glm::dvec3(0.0),
          glm::angleAxis(most * std::sin(2600.0 * kDegree / most * t), glm::dvec3(0.0, 1.0, 0.0))};
}
using HeadMotion = Pose (*)(double);

StepInput input_of(HeadMotion head, int step) {
  const Pose before = head((step - 1) * kSubstepS);
  const Pose now = head(step * kSubstepS);
  StepInput input;
  input.h_s = kSubstepS;
  input.head_shift_m = now.position_m - before.position_m;
  input.world_from_head_rotation = now.rotation;
  input.groom_gravity_in_head_mps2 = input.gravity_mps2;
  return input;
}

std::vector<SphereCollider> turned_colliders(const std::vector<SphereCollider>& colliders,
                                             const StepInput& input) {
  std::vector<SphereCollider> turned = colliders;
  for (SphereCollider& sphere : turned)
    sphere.center_m = glm::vec3(input.world_from_head_rotation * glm::dvec3(sphere.center_m));
  return turned;
}

uint32_t first_free(const Groom& groom) {
  uint32_t first = 0;
  while (groom.pinned[first] != 0) ++first;
  return first;
}

/// Of every strand the angle between its first free segment and where it is groomed, degrees.
std::vector<double> root_angles_deg(const Groom& groom, const SolverState& state,
                                    const glm::dquat& rotation) {
  const uint32_t strands = groom.strand_count();
  const uint32_t first = first_free(groom);
  std::vector<double> angles;
  for (uint32_t s = 0; s < strands; ++s) {
    const glm::vec3* rest = groom.rest_position_m.data() + groom.offset[s];
    const glm::dvec3 groomed = rotation * (glm::dvec3(rest[first]) - glm::dvec3(rest[first - 1]));
    const glm::dvec3 now = glm::dvec3(state.position_m[size_t{first} * strands + s]) -
                           glm::dvec3(state.position_m[size_t{first - 1} * strands + s]);
    angles.push_back(std::atan2(glm::length(glm::cross(groomed, now)), glm::dot(groomed, now)) / kDegree);
  }
  return angles;
}

double largest(const std::vector<double>& values) {
  return *std::max_element(values.begin(), values.end());
}

glm::dvec3 at(const std::vector<glm::vec3>& plane, size_t i) {
  return glm::dvec3(plane[i]);
}

class FollicleLimits : public SolverTest {
 protected:
  std::unique_ptr<Solver> make_held(const SolverKind& kind, const Groom& groom,
                                    const SolverParameters& given = {},
                                    const glm::dquat& rotation = kUpright) {
    return make(kind, groom, given, rotation, held_features());
  }
};

// ---- what a viewer sees of hair in violent motion ----

struct Excitation {
  const char* name;
  HeadMotion head;
};
constexpr Excitation kExcitations[] = {{"10 g shake", shake}, {"2,600 deg/s", turn}};

class RootsInMotion : public FollicleLimits {
 protected:
  /// 95 % of all angles of all steps are below this.
  double p95_deg(const SolverKind& kind, const Groom& groom, const std::vector<SphereCollider>& colliders,
                 HeadMotion head, double limit_deg) {
    constexpr int kSteps = 60;
    auto solver = make_held(kind, groom);
    std::vector<double> all;
    for (int step = 1; step <= kSteps; ++step) {
      StepInput input = held(input_of(head, step), limit_deg);
      input.colliders = turned_colliders(colliders, input);
      solver->substep(input);
      const std::vector<double> angles =
          root_angles_deg(groom, read(*solver), input.world_from_head_rotation);
      all.insert(all.end(), angles.begin(), angles.end());
    }
    return quantile(all, 0.95);
  }

  void expect_upright_roots(const SceneDesc& scene, uint32_t strand_count) {
    const auto content = load_scene_content(scene);
    ASSERT_TRUE(content) << content.error().to_string();
    double most_free_deg = 0.0;
    for (const SolverRow& row : solver_table()) {
      const SolverKind kind = kind_of_long_test(row);
      // In double, on one thread.
      const Groom groom = test::some_strands(content->groom, row.has_kernel ? strand_count : 6);
      for (const Excitation& excitation : kExcitations) {
        SCOPED_TRACE(row.name + ", " + excitation.name);
        const double free_deg = p95_deg(kind, groom, content->colliders, excitation.head, 180.0);
        const double held_deg =
            p95_deg(kind, groom, content->colliders, excitation.head, scene.follicle_limit_deg);
        EXPECT_LE(held_deg, kLimitDeg + kRoundingDeg);
        most_free_deg = std::max(most_free_deg, free_deg);
        fmt::print("{}, {}: 95 % of the roots within {:.1f} degrees, {:.1f} without the limit\n", row.name,
                   excitation.name, held_deg, free_deg);
      }
    }
    EXPECT_GT(most_free_deg, 3.0 * kLimitDeg) << "the motions are such that need a limit";
  }
};

TEST_F(RootsInMotion, BuiltInHair) {
  expect_upright_roots(built_in_scene(), static_cast<uint32_t>(on_grid(64, 500)));
}

TEST_F(RootsInMotion, SintelsHair) {
  const std::filesystem::path groom =
      std::filesystem::path(STRANDCAST_SHARED_DATA) / "grooms/sintel_11400x16.tfx";
  REQUIRE_SHARED(groom);
  const auto scene = built_in_scene_with({"groom.file.path=" + groom.string()});
  ASSERT_TRUE(scene) << scene.error().to_string();
  expect_upright_roots(*scene, static_cast<uint32_t>(on_grid(64, 500)));
}

// ---- laws ----

TEST_F(FollicleLimits, NoRootLeansFurtherWhateverTheHeadDoes) {
  for (const Pinning pinning : {Pinning::Root, Pinning::RootPair}) {
    const Groom groom = make_test_groom({.strand_count = 7, .vertex_count = 7, .pinning = pinning});
    for (const SolverKind& kind : all_kinds()) {
      SCOPED_TRACE(kind.name());
      auto solver = make_held(kind, groom);
      double most_free_deg = 0.0;
      auto free = make_held(kind, groom);
      for (int step = 1; step <= 30; ++step) {
        const StepInput input = step <= 20 ? input_of(turn, step) : moving_input(step, kSubstepS);
        solver->substep(held(input));
        free->substep(input);
        ASSERT_LE(largest(root_angles_deg(groom, read(*solver), input.world_from_head_rotation)),
                  kLimitDeg + kRoundingDeg)
            << "step " << step;
        most_free_deg = std::max(
            most_free_deg, largest(root_angles_deg(groom, read(*free), input.world_from_head_rotation)));
      }
      EXPECT_GT(most_free_deg, kLimitDeg) << "the motion is one that needs a limit";
    }
  }
}

/// The head turns fast and is shaken, in colliders.
StepInput violent_input(int step) {
  StepInput input = input_of(turn, step);
  input.head_shift_m = input_of(shake, step).head_shift_m;
  input.colliders = {{glm::vec3(0.0f), 0.099f},
                     {glm::vec3(input.world_from_head_rotation * glm::dvec3(0.0, -0.05, 0.04)), 0.08f}};
  return input;
}

double depth_m(const StepInput& input, const glm::dvec3& point) {
  double deepest_m = 0.0;
  for (const SphereCollider& sphere : input.colliders)
    deepest_m = std::max(
        deepest_m, static_cast<double>(sphere.radius_m) - glm::distance(point, glm::dvec3(sphere.center_m)));
  return deepest_m;
}

// One substep from the same state with and without: strands whose roots stand are the same to the bit; the
// others have every segment as long as without and no vertex deeper in a collider; only the end of the first
// free segment has another velocity, which is no faster seen from its follicle.
TEST_F(FollicleLimits, HoldsOnlyWhatLeansAndTakesNothingElse) {
  constexpr double kTightDeg = 5.0;  // so that the stiffest model has something to hold
  const Groom groom = make_test_groom({.strand_count = 43});
  const uint32_t strands = groom.strand_count();
  const uint32_t first = first_free(groom);
  uint32_t unmoved_of_all = 0;
  for (const SolverKind& kind : all_kinds()) {
    SCOPED_TRACE(kind.name());
    auto free_solver = make_held(kind, groom);
    auto held_solver = make_held(kind, groom);
    uint32_t moved = 0, unmoved = 0;
    glm::dquat before = kUpright;
    for (int step = 1; step <= 12; ++step) {
      const StepInput input = violent_input(step);
      // Strands that are written otherwise than they are lose their history, on both sides.
      const SolverState state = read(*held_solver);
      SolverState other = state;
      for (glm::vec3& velocity : other.velocity_mps) velocity.x += 1.0f;
      for (Solver* solver : {free_solver.get(), held_solver.get()}) {
        solver->write(other);
        solver->write(state);
      }
      free_solver->substep(input);
      held_solver->substep(held(input, kTightDeg));
      const SolverState free = read(*free_solver);
      const SolverState now = read(*held_solver);
      const std::vector<double> angles = root_angles_deg(groom, free, input.world_from_head_rotation);
      for (uint32_t s = 0; s < strands; ++s) {
        bool is_same = true;
        for (size_t i = s; i < now.position_m.size(); i += strands)
          is_same = is_same && now.position_m[i] == free.position_m[i] &&
                    now.velocity_mps[i] == free.velocity_mps[i];
        if (std::abs(angles[s] - kTightDeg) > kRoundingDeg) {
          ASSERT_EQ(is_same, angles[s] < kTightDeg) << angles[s];
        }
        is_same ? ++unmoved : ++moved;
        if (is_same) continue;
        for (uint32_t i = first; i < groom.vertex_count(0); ++i) {
          const size_t here = size_t{i} * strands + s;
          const auto segment_m = [&](const SolverState& of) {
            return glm::distance(at(of.position_m, here), at(of.position_m, here - strands));
          };
          ASSERT_NEAR(segment_m(now), segment_m(free), kPositionRoundingM) << i;
          ASSERT_LE(depth_m(input, at(now.position_m, here)),
                    depth_m(input, at(free.position_m, here)) + 1e-6)
              << i;
          ASSERT_TRUE(i == first || now.velocity_mps[here] == free.velocity_mps[here]) << i;
        }
        const size_t end = size_t{first} * strands + s;
        const glm::dquat carry = input.world_from_head_rotation * glm::conjugate(before);
        const glm::dvec3 root = at(free.position_m, end);
        const glm::dvec3 follicle_mps =
            (input.head_shift_m + root - glm::conjugate(carry) * root) / input.h_s;
        ASSERT_LE(glm::distance(at(now.velocity_mps, end), follicle_mps),
                  glm::distance(at(free.velocity_mps, end), follicle_mps) + 1e-4);
      }
      before = input.world_from_head_rotation;
    }
    EXPECT_GT(moved, 0u);
    unmoved_of_all += unmoved;
    fmt::print("{}: {} strands held, {} left alone\n", kind.name(), moved, unmoved);
  }
  EXPECT_GT(unmoved_of_all, 0u);
}

// A scene without a limit has no trace of it, and an input without one leaves a solver that could alone.
TEST_F(FollicleLimits, FreeRootsAreAsIfThereWereNoLimit) {
  const Groom groom = make_test_groom({});
  for (const SolverKind& kind : all_kinds()) {
    SCOPED_TRACE(kind.name());
    auto plain = make(kind, groom);
    auto able = make_held(kind, groom);
    auto unable = make(kind, groom);
    for (int step = 1; step <= 6; ++step) {
      plain->substep(moving_input(step, kSubstepS));
      able->substep(held(moving_input(step, kSubstepS), 180.0));
      // A kernel made without the feature has no pass to hold roots with; in double there is no kernel.
      unable->substep(held(moving_input(step, kSubstepS), kind.host.is_kernel() ? kLimitDeg : 180.0));
    }
    for (const Solver* other : {able.get(), unable.get()}) {
      SolverState state;
      const_cast<Solver*>(other)->read(state);
      EXPECT_EQ(state.position_m, read(*plain).position_m);
      EXPECT_EQ(state.velocity_mps, read(*plain).velocity_mps);
    }
  }
}

// Strands that are held at both ends keep their lengths rather than their roots.
TEST_F(FollicleLimits, HeldTipsAreLeftAlone) {
  const Groom groom = make_test_groom({.pinning = Pinning::BothEnds});
  for (const SolverKind& kind : all_kinds()) {
    SCOPED_TRACE(kind.name());
    auto free = make_held(kind, groom);
    auto solver = make_held(kind, groom);
    for (int step = 1; step <= 6; ++step) {
      free->substep(moving_input(step, kSubstepS));
      solver->substep(held(moving_input(step, kSubstepS)));
    }
    EXPECT_EQ(read(*solver).position_m, read(*free).position_m);
  }
}

TEST_F(FollicleLimits, TurnedInputsGiveTheTurnedMotion) {
  const Groom groom = make_test_groom({});
  const glm::dquat turned_by = glm::angleAxis(2.1, glm::normalize(glm::dvec3(0.3, -1.0, 0.5)));
  for (const SolverKind& kind : all_kinds()) {
    SCOPED_TRACE(kind.name());
    const glm::dquat start = moving_input(0, kSubstepS).world_from_head_rotation;
    auto solver = make_held(kind, groom, {}, start);
    auto other = make_held(kind, groom, {}, turned_by * start);
    for (int step = 1; step <= 10; ++step) {
      solver->substep(held(moving_input(step, kSubstepS)));
      other->substep(held(turned(moving_input(step, kSubstepS), turned_by)));
    }
    SolverState expected = read(*solver);
    for (glm::vec3& point : expected.position_m) point = glm::vec3(turned_by * glm::dvec3(point));
    const double growth = bounds_of(*kind.row).rounding_growth;
    EXPECT_LE(largest_distance_m(read(*other).position_m, expected.position_m), growth * growth * 1e-4);
  }
}

// The kernel and the double-precision version share no code: from one state they move strands to one place.
TEST_F(FollicleLimits, TheKernelFollowsItsReference) {
  // As tests/compare/solver_parity_test.cpp has it for a few steps of strands of this size; a first segment
  // that is just about at its limit may be moved by one and not by the other, which is a rounding too.
  constexpr double kBoundM = 3e-5;
  constexpr double kTightDeg = 2.0;  // so that the stiffest model has something to hold
  const Groom groom = make_test_groom({});
  for (const SolverKind& kind : all_kinds()) {
    if (!kind.host.is_kernel()) continue;
    SCOPED_TRACE(kind.name());
    const SolverParameters given = {{"style_stiffness_per_s2", 120.0}};
    auto kernel = make_held(kind, groom, given);
    auto reference = make_held({kind.row, kReferenceHost}, groom, given);
    auto free = make_held(kind, groom, given);
    const double growth = bounds_of(*kind.row).rounding_growth;
    const double stiff_m = bounds_of(*kind.row).stiff_rounding_m * 16.0 * 16.0;
    for (int step = 1; step <= 4; ++step) {
      kernel->substep(held(moving_input(step, kSubstepS), kTightDeg));
      reference->substep(held(moving_input(step, kSubstepS), kTightDeg));
      free->substep(moving_input(step, kSubstepS));
      const double bound_m = kBoundM * std::pow(growth, step - 1) + stiff_m;
      ASSERT_LE(largest_distance_m(read(*kernel).position_m, read(*reference).position_m), bound_m) << step;
      ASSERT_LE(largest_distance_m(read(*kernel).velocity_mps, read(*reference).velocity_mps),
                3.0 * bound_m / kSubstepS)
          << step;
    }
    EXPECT_GT(largest_distance_m(read(*kernel).position_m, read(*free).position_m), 1e-3)
        << "roots were held";
  }
}

// Limp hair on a head that lies on its side hangs over the edge of its cones. It comes to rest there and
// stays: what pulls it out in a step is taken from its velocity too, so that nothing buzzes or gathers speed.
TEST_F(FollicleLimits, HairHeldAtItsRootsComesToRest) {
  const Groom groom = make_test_groom({.strand_count = 7, .vertex_count = 8});
  const glm::dquat on_its_side = glm::angleAxis(1.57, glm::dvec3(0.0, 0.0, 1.0));
  StepInput input = held(StepInput{});
  input.world_from_head_rotation = on_its_side;
  for (const SolverKind& kind : all_kinds()) {
    if (!kind.row->comes_to_rest) continue;
    SCOPED_TRACE(kind.name());
    auto solver = make_held(kind, groom, {{"sag_free", 0.0}}, on_its_side);
    for (int step = 0; step < 1080; ++step) solver->substep(input);
    const SolverState before = read(*solver);
    const std::vector<double> angles = root_angles_deg(groom, before, on_its_side);
    double most_m = 0.0;
    for (int step = 0; step < 30; ++step) {
      const std::vector<glm::vec3> last_m = read(*solver).position_m;
      solver->substep(input);
      most_m = std::max(most_m, largest_distance_m(read(*solver).position_m, last_m));
    }
    fmt::print("{}: roots at {:.1f} degrees, {:.1e} m in a step\n", kind.name(), largest(angles), most_m);
    // A tenth of a millimetre in a step is what counts as rest in the stability report.
    EXPECT_LE(most_m, 1e-4);
  }
}

}  // namespace
}  // namespace strandcast::follicle_limit_test
