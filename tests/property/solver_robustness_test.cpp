// Every row of the solver table stays finite, and as long as it should be, whatever it is given.
#include <filesystem>
#include <limits>

#include "common/groom/groom_file.h"
#include "tests/support/shared_data.h"
#include "tests/support/solver_fixture.h"

namespace strandcast::solver_robustness_test {
namespace {

constexpr double kSubstepS = 1.0 / 60.0;
constexpr double kLengthTolerance = 1e-5;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

class SolverRobustness : public SolverTest {
 protected:
  /// Some motion; finite and of the right lengths after every step.
  void expect_sound_motion(const SolverKind& kind, const Groom& groom, bool checks_lengths, int steps = 120) {
    auto solver = make(kind, groom);
    for (int step = 1; step <= steps; ++step) {
      solver->substep(moving_input(step, kSubstepS));
      const SolverState state = read(*solver);
      ASSERT_TRUE(is_finite(state)) << "step " << step;
      if (checks_lengths && kind.row->stretch_bound == 0.0) {
        ASSERT_LE(length_excess_m(groom, state, kLengthTolerance), 0.0) << "step " << step;
      }
    }
  }
};

/// A strand upward from (x, 0.1, 0) with the given segment lengths.
std::vector<glm::vec3> strand_of(float x, const std::vector<float>& segments_m) {
  std::vector<glm::vec3> strand = {{x, 0.1f, 0.0f}};
  for (const float length : segments_m) strand.push_back(strand.back() + glm::vec3(0.0f, length, 0.0f));
  return strand;
}

TEST_F(SolverRobustness, OddGroomsStaySound) {
  const std::vector<std::pair<std::string, Groom>> grooms = {
      {"zero lengths", groom_from({strand_of(0.0f, {0.02f, 0.0f, 0.02f, 0.0f, 0.0f, 0.02f}),
                                   strand_of(0.01f, {0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f})},
                                  Pinning::RootPair)},
      {"lengths of 1e-7", groom_from({strand_of(0.0f, {0.02f, 1e-7f, 0.02f, 1e-7f, 1e-7f, 0.02f}),
                                      strand_of(0.01f, {1e-7f, 1e-7f, 1e-7f, 1e-7f, 1e-7f, 1e-7f})},
                                     Pinning::Root)},
      {"lengths from 1e-6 to 1",
       groom_from({strand_of(0.0f, {1e-6f, 1.0f, 1e-5f, 0.1f, 1e-6f, 1.0f})}, Pinning::Root)},
      {"two vertices", groom_from({strand_of(0.0f, {0.1f})}, Pinning::Root)},
      {"two vertices, both pinned", groom_from({strand_of(0.0f, {0.1f})}, Pinning::RootPair)},
      {"64 vertices", groom_from({strand_of(0.0f, std::vector<float>(63, 0.004f))}, Pinning::RootPair)},
      {"folded back",
       groom_from({{{0.f, 0.1f, 0.f}, {0.f, 0.2f, 0.f}, {0.f, 0.1f, 0.f}, {0.f, 0.2f, 0.f}}}, Pinning::Root)},
      {"all at the head joint", groom_from({std::vector<glm::vec3>(5, glm::vec3(0.0f))}, Pinning::Root)},
  };
  for (const auto& [name, groom] : grooms) {
    // The first of them on OpenGL's software device too, which takes most of the time.
    const bool is_first = name == grooms.front().first;
    for (const SolverKind& kind : is_first ? all_kinds() : kinds_of_long_tests()) {
      SCOPED_TRACE(kind.name() + ", " + name);
      expect_sound_motion(kind, groom, true);
    }
  }
}

TEST_F(SolverRobustness, StrandsHeldAtBothEndsStayFinite) {
  const std::vector<std::pair<std::string, Groom>> grooms = {
      {"no free vertex", groom_from({strand_of(0.0f, {0.02f, 0.02f, 0.02f})}, Pinning::BothEnds)},
      {"one free vertex", groom_from({strand_of(0.0f, {0.02f, 0.02f, 0.02f, 0.02f})}, Pinning::BothEnds)},
      {"zero lengths",
       groom_from({strand_of(0.0f, {0.02f, 0.0f, 0.0f, 0.0f, 0.0f, 0.02f})}, Pinning::BothEnds)},
      {"uneven",
       groom_from({strand_of(0.0f, {0.02f, 0.3f, 0.001f, 0.001f, 0.1f, 0.02f})}, Pinning::BothEnds)},
  };
  for (const auto& [name, groom] : grooms) {
    const bool is_last = name == grooms.back().first;
    for (const SolverKind& kind : is_last ? all_kinds() : kinds_of_long_tests()) {
      SCOPED_TRACE(kind.name() + ", " + name);
      expect_sound_motion(kind, groom, false);
    }
  }
}

TEST_F(SolverRobustness, ARealGroomWithTinyStrandsStaysSound) {
  const std::filesystem::path path =
      std::filesystem::path(STRANDCAST_SHARED_DATA) / "grooms/Ratboy_mohawk.tfx";
  REQUIRE_SHARED(path);
  GroomFileOptions options;
  options.path = path;
  const auto groom = load_groom(options);
  ASSERT_TRUE(groom) << groom.error().to_string();
  // Of OpenGL's software device, which takes most of the time, one row on the small grid.
  std::vector<SolverKind> kinds = kinds_of_long_tests();
  if (test_grid() == TestGrid::Small) kinds.push_back(kinds_of(**find_solver("dftl")).front());
  for (const SolverKind& kind : kinds) {
    if (!kind.host.is_kernel()) continue;
    SCOPED_TRACE(kind.name());
    expect_sound_motion(kind, *groom, true, 30);
  }
}

TEST_F(SolverRobustness, ExtremeInputsStayFiniteAndExact) {
  const Groom groom = make_law_groom();
  std::vector<std::pair<std::string, StepInput>> inputs;
  const auto add = [&inputs](const std::string& name, const std::function<void(StepInput&)>& change) {
    StepInput input = moving_input(3, kSubstepS);
    change(input);
    inputs.emplace_back(name, input);
  };
  for (const double value : {1e3, 1e9, 1e300, -1e300, kInfinity, kNan}) {
    add("gravity", [value](StepInput& input) { input.gravity_mps2 = {value, -value, 1.0}; });
    add("groom's gravity", [value](StepInput& input) {
      input.groom_gravity_in_head_mps2 = {value, 0.0, -value};
    });
    add("wind", [value](StepInput& input) { input.wind_mps = {value, 0.0, -value}; });
    add("shift", [value](StepInput& input) { input.head_shift_m = {0.0, value, value}; });
    add("substep", [value](StepInput& input) { input.h_s = value; });
    add("rotation", [value](StepInput& input) { input.world_from_head_rotation = {value, value, 0.0, 0.0}; });
    const float single = static_cast<float>(value);
    add("gust", [single](StepInput& input) {
      for (GustWave& wave : input.gusts) wave = {glm::vec3(single), glm::vec3(single), single};
    });
    add("collider", [single](StepInput& input) {
      input.colliders = {{glm::vec3(single), single}, {glm::vec3(0.0f), single}, {glm::vec3(0.0f), -single}};
    });
  }
  add("zero substep", [](StepInput& input) { input.h_s = 0.0; });
  add("zero rotation", [](StepInput& input) { input.world_from_head_rotation = {0.0, 0.0, 0.0, 0.0}; });
  add("too many colliders", [](StepInput& input) { input.colliders.assign(100, {glm::vec3(0.0f), 0.1f}); });
  add("too many gusts", [](StepInput& input) { input.gusts.assign(100, input.gusts[0]); });
  for (const SolverKind& kind : all_kinds()) {
    auto solver = make(kind, groom);
    for (const auto& [name, input] : inputs) {
      SCOPED_TRACE(kind.name() + ", " + name);
      for (int step = 0; step < 3; ++step) {
        solver->substep(input);
        const SolverState state = read(*solver);
        ASSERT_TRUE(is_finite(state));
        if (kind.row->stretch_bound == 0.0) {
          ASSERT_LE(length_excess_m(groom, state, kLengthTolerance), 0.0);
        }
      }
    }
  }
}

TEST_F(SolverRobustness, EveryParameterMayStandAtItsBounds) {
  const Groom groom = make_law_groom();
  for (const SolverKind& kind : kinds_of_long_tests()) {
    for (const SolverParameterInfo& info : kind.row->parameters) {
      for (const double value : {info.minimum, info.maximum}) {
        SCOPED_TRACE(fmt::format("{}, {} = {}", kind.name(), info.name, value));
        auto solver = make(kind, groom, {{info.name, value}});
        for (int step = 1; step <= 30; ++step) solver->substep(moving_input(step, kSubstepS));
        EXPECT_TRUE(is_finite(read(*solver)));
      }
    }
  }
}

TEST_F(SolverRobustness, ABrokenStrandRecoversAndTouchesNoOther) {
  const Groom groom = make_test_groom({});
  const uint32_t strand_count = groom.strand_count();
  constexpr uint32_t kBroken = 5;
  for (const SolverKind& kind : all_kinds()) {
    for (const float value :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 1e30f}) {
      SCOPED_TRACE(fmt::format("{}, {}", kind.name(), value));
      auto solver = make(kind, groom);
      auto sound = make(kind, groom);
      SolverState state = read(*solver);
      state.position_m[7 * strand_count + kBroken].y = value;
      state.velocity_mps[9 * strand_count + kBroken].x = value;
      state.position_m[kBroken].z = value;  // a pinned vertex
      solver->write(state);
      for (int step = 1; step <= 3; ++step) {
        solver->substep(moving_input(step, kSubstepS));
        sound->substep(moving_input(step, kSubstepS));
      }
      state = read(*solver);
      EXPECT_TRUE(is_finite(state));
      if (kind.row->stretch_bound == 0.0) {
        EXPECT_LE(length_excess_m(groom, state, kLengthTolerance), 0.0);
      }
      const SolverState expected = read(*sound);
      for (size_t i = 0; i < state.position_m.size(); ++i) {
        if (i % strand_count == kBroken) continue;
        ASSERT_EQ(state.position_m[i], expected.position_m[i]);
      }
    }
  }
}

TEST_F(SolverRobustness, AVertexOnItsLeaderTakesTheGroomedDirection) {
  const Groom groom = groom_from({strand_of(0.0f, {0.1f})}, Pinning::Root);
  for (const SolverKind& kind : all_kinds()) {
    SCOPED_TRACE(kind.name());
    auto solver = make(kind, groom,
                       {{"style_stiffness_per_s2", 0.0},
                        {"stretch_stiffness_n_per_m", 1e6},
                        {"stretch_damping_ns_per_m", 0.0}});
    const SolverState groomed = read(*solver);
    SolverState folded = groomed;
    folded.position_m[1] = folded.position_m[0];
    solver->write(folded);
    solver->substep(calm_input());
    // A compliant segment gives way by a few millionths.
    const double allowed_m = kind.row->stretch_bound > 0.0 ? 3e-6 : 1e-7;
    EXPECT_LE(largest_distance_m(read(*solver).position_m, groomed.position_m), allowed_m);
  }
}

// The state is relative to the head joint: where the head is does not matter, only how it moves. A teleport
// that is announced is no movement; one that is not leaves strands that settle as if nothing had happened.
TEST_F(SolverRobustness, AKilometreInOneStepSettlesToTheSameShape) {
  const Groom groom = make_law_groom();
  for (const SolverKind& kind : kinds_of_long_tests()) {
    SCOPED_TRACE(kind.name());
    auto solver = make(kind, groom, {{"air_drag_per_s", 8.0}});
    auto calm = make(kind, groom, {{"air_drag_per_s", 8.0}});
    StepInput input = calm_input();
    input.head_shift_m = {800.0, 0.0, -600.0};
    solver->substep(input);
    ASSERT_TRUE(is_finite(read(*solver)));
    if (kind.row->stretch_bound == 0.0) {
      ASSERT_LE(length_excess_m(groom, read(*solver), kLengthTolerance), 0.0);
    }
    input.head_shift_m = glm::dvec3(0.0);
    for (int step = 0; step < 1200; ++step) {
      solver->substep(input);
      calm->substep(input);
    }
    EXPECT_LE(largest_distance_m(read(*solver).position_m, read(*calm).position_m), 1e-3);
  }
}

}  // namespace
}  // namespace strandcast::solver_robustness_test
