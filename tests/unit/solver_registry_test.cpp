#include "server/sim/solver_registry.h"

#include <limits>
#include <set>

#include "server/sim/chain_parameters.h"
#include "server/sim/strand_layout.h"
#include "tests/support/sim_scene.h"
#include "tests/support/solver_bounds.h"

namespace strandcast::solver_registry_test {
namespace {

using testing::HasSubstr;

TEST(SolverRegistry, RowsAreComplete) {
  std::set<std::string> names;
  for (const SolverRow& row : solver_table()) {
    EXPECT_TRUE(names.insert(row.name).second) << row.name << " twice";
    EXPECT_FALSE(row.summary.empty());
    EXPECT_FALSE(row.source.empty());
    EXPECT_TRUE(row.make && row.make_reference);
    for (const SolverParameterInfo& info : row.parameters) {
      EXPECT_LE(info.minimum, info.default_value) << info.name;
      EXPECT_GE(info.maximum, info.default_value) << info.name;
      EXPECT_FALSE(info.summary.empty()) << info.name;
    }
    const auto found = find_solver(row.name);
    ASSERT_TRUE(found);
    EXPECT_EQ(*found, &row);
  }
}

TEST(SolverRegistry, TheTestsHaveBoundsForEveryRowAndForNoOther) {
  std::set<std::string> of_rows;
  std::set<std::string> of_bounds;
  for (const SolverRow& row : solver_table()) of_rows.insert(row.name);
  for (const auto& [name, bounds] : solver_bounds()) of_bounds.insert(name);
  EXPECT_EQ(of_rows, of_bounds) << "tests/support/solver_bounds.h";
}

TEST(SolverRegistry, EffortAndHairParametersAreTheRowsOwnAndInRange) {
  int hair_count = 0;
  for (const SolverRow& row : solver_table()) {
    if (!row.effort_parameter.empty()) {
      const auto effort = complete_parameters(row, {{row.effort_parameter, 2.0}});
      EXPECT_TRUE(effort) << effort.error().to_string();
    }
    if (!row.as_hair) continue;
    ++hair_count;
    for (const double segment_m : {0.3 / 63, 0.3 / 7}) {
      const auto complete = complete_parameters(row, row.as_hair(HairConstants(), segment_m, 1.0 / 60.0));
      EXPECT_TRUE(complete) << complete.error().to_string();
    }
  }
  EXPECT_GE(hair_count, 2);
}

// E I and mass per length of the reference hair as the analytic tests state them.
TEST(SolverRegistry, HairHasTheStatedStiffnesses) {
  const HairConstants hair;
  EXPECT_NEAR(hair.bending_stiffness_nm2(), 1.4726e-8, 1e-12);
  EXPECT_NEAR(hair.linear_density_kgpm(), 1.0210e-5, 1e-9);
  EXPECT_NEAR(hair.twist_stiffness_nm2() / hair.bending_stiffness_nm2(), 1.0 / 1.45, 1e-12);
  EXPECT_NEAR(hair.stretch_stiffness_n() * 0.09 / hair.bending_stiffness_nm2(), 1.44e8, 1.0);
}

// A coil has so much that is not twist that two percent of stiffness do not show in it.
TEST(SolverRegistry, ChainsHaveTheStiffnessesOfTheirHair) {
  const HairConstants hair;
  for (const char* name : {"articulated", "super_helix"}) {
    const SolverRow& row = **find_solver(name);
    const auto complete = complete_parameters(row, row.as_hair(hair, 0.01, 1.0 / 60.0));
    ASSERT_TRUE(complete) << complete.error().to_string();
    const ChainParameters chain = read_chain_parameters(*complete, row.effort_parameter);
    const double mass_kgpm = hair.linear_density_kgpm();
    EXPECT_NEAR(chain.bend_stiffness_m4ps2 * mass_kgpm / hair.bending_stiffness_nm2(), 1.0, 1e-9) << name;
    EXPECT_NEAR(chain.twist_stiffness_m4ps2 * mass_kgpm / hair.twist_stiffness_nm2(), 1.0, 1e-9) << name;
  }
}

TEST(SolverRegistry, UnknownSolversListTheKnownOnes) {
  const auto found = find_solver("dftl2");
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, ErrorCode::NotFound);
  std::string names;
  for (const SolverRow& row : solver_table()) names += (names.empty() ? "" : ", ") + row.name;
  EXPECT_EQ(found.error().message, "unknown solver 'dftl2' (known: " + names + ")");
}

TEST(SolverRegistry, ParametersAreFilledInAndChecked) {
  const SolverRow& row = **find_solver("dftl");
  const auto complete = complete_parameters(row, {{"s_damping", 0.5}});
  ASSERT_TRUE(complete);
  EXPECT_EQ(complete->size(), row.parameters.size());
  EXPECT_EQ(complete->at("s_damping"), 0.5);
  EXPECT_GT(complete->at("max_speed_mps"), 0.0);

  const auto others = complete_parameters(row, {{"style_margin", 0.0}});
  ASSERT_FALSE(others);
  EXPECT_THAT(others.error().message,
              testing::HasSubstr("but direct_rod has: choose it with solver.name=direct_rod"));
  const auto unknown = complete_parameters(row, {{"s_dumping", 0.5}});
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().code, ErrorCode::BadInput);
  EXPECT_THAT(unknown.error().message,
              testing::AllOf(HasSubstr("'s_dumping'"), HasSubstr("known: s_damping")));
  for (const double value : {-0.01, 1.01, std::numeric_limits<double>::quiet_NaN()}) {
    const auto outside = complete_parameters(row, {{"s_damping", value}});
    ASSERT_FALSE(outside);
    EXPECT_THAT(outside.error().message,
                testing::AllOf(HasSubstr("s_damping"), HasSubstr("allowed: 0 to 1")));
  }
}

TEST(StrandLayout, IsVertexMajorWithLengthsAndArc) {
  const Groom groom = groom_from({{{0.f, 0.f, 0.f}, {0.f, 1.f, 0.f}, {0.f, 1.f, 3.f}},
                                  {{5.f, 0.f, 0.f}, {6.f, 0.f, 0.f}, {7.f, 0.f, 0.f}}},
                                 Pinning::Root);
  const auto layout = make_strand_layout(groom);
  ASSERT_TRUE(layout);
  EXPECT_EQ(layout->strand_count, 2u);
  EXPECT_EQ(layout->vertex_count, 3u);
  EXPECT_EQ(layout->pinned_root_count, 1u);
  EXPECT_EQ(layout->tail_begin(), 3u);
  EXPECT_EQ(layout->rest[layout->index(2, 0)], glm::vec4(0.f, 1.f, 3.f, 3.f));
  EXPECT_EQ(layout->rest[1], glm::vec4(5.f, 0.f, 0.f, 0.f));
  EXPECT_FLOAT_EQ(layout->arc[layout->index(1, 0)], 0.25f);
  EXPECT_FLOAT_EQ(layout->length_m[0], 4.0f);
}

TEST(StrandLayout, RefusesWhatTheKernelsCannotRun) {
  const auto refused = [](const std::function<void(Groom&)>& damage) {
    Groom groom = make_test_groom({});
    damage(groom);
    const auto layout = make_strand_layout(groom);
    return layout ? std::string("accepted") : layout.error().message;
  };
  EXPECT_THAT(refused([](Groom& groom) { groom.offset.clear(); }), HasSubstr("no strands"));
  EXPECT_THAT(refused([](Groom& groom) { --groom.offset[4]; }),
              HasSubstr("strand 3 does not have 16 vertices"));
  EXPECT_THAT(refused([](Groom& groom) { groom.pinned.pop_back(); }), HasSubstr("335 pinned flags"));
  EXPECT_THAT(refused([](Groom& groom) { groom.rest_position_m.clear(); }), HasSubstr("0 positions"));
  EXPECT_THAT(refused([](Groom& groom) { groom.pinned[0] = 0; }),
              HasSubstr("vertex 0 of strand 0 is not pinned"));
  EXPECT_THAT(refused([](Groom& groom) { groom.pinned[9] = 1; }), HasSubstr("vertex 9 of strand 0"));
  EXPECT_THAT(refused([](Groom& groom) { groom.pinned[16 * 2 + 1] = 0; }), HasSubstr("strand 2 pins 1 + 0"));
}

TEST(StrandLayout, LimitsWhatAStepMayAskFor) {
  StepInput input;
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    input.h_s = bad;
    EXPECT_EQ(limited_substep_s(input), kMinSubstepS);
  }
  input.h_s = 5.0;
  EXPECT_EQ(limited_substep_s(input), kMaxSubstepS);
  EXPECT_EQ(limited(std::numeric_limits<double>::quiet_NaN(), 3.0), 0.0);
  EXPECT_EQ(limited(-std::numeric_limits<double>::infinity(), 3.0), -3.0);
  EXPECT_EQ(limited_rotation({0.0, 0.0, 0.0, 0.0}), glm::dquat(1.0, 0.0, 0.0, 0.0));
  EXPECT_EQ(limited_rotation({2.0, 0.0, 0.0, 0.0}), glm::dquat(1.0, 0.0, 0.0, 0.0));
}

}  // namespace
}  // namespace strandcast::solver_registry_test
