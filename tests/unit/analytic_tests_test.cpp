// Which tests a row takes, and what those find that a very small work-precision leaves out; double precision.
#include <algorithm>
#include <cmath>

#include "server/report/analytic_tests.h"

namespace strandcast::analytic_tests_test {
namespace {

const AnalyticTest& test_named(const std::string& name) {
  const auto& tests = analytic_tests();
  const auto found =
      std::find_if(tests.begin(), tests.end(), [&](const AnalyticTest& test) { return test.name == name; });
  EXPECT_NE(found, tests.end()) << name;
  return *found;
}

AnalyticResult run_in_double(const std::string& name, const char* solver, uint32_t vertex_count) {
  const AnalyticTest& test = test_named(name);
  const double rate_hz = test.fixed_rate_hz > 0.0 ? test.fixed_rate_hz : 60.0;
  return test.run({}, {*find_solver(solver), test.material, vertex_count, rate_hz});
}

TEST(AnalyticTests, RowsTakeTheTestsOfTheirPhysics) {
  EXPECT_TRUE(has_physics(**find_solver("direct_rod"), test_named("T1 Gamma 10")));
  EXPECT_FALSE(has_physics(**find_solver("dftl"), test_named("T1 Gamma 10"))) << "no stiffness";
  EXPECT_TRUE(has_physics(**find_solver("dftl"), test_named("T4, T7")));
  EXPECT_FALSE(has_physics(**find_solver("xpbd"), test_named("T12"))) << "no twist";
}

// Equilibria of a rod, whatever the vertices: far heavier hair, and a rest shape of a full turn.
TEST(AnalyticTests, HeavyHairAndRolledHairComeToRestWhereTheyShould) {
  EXPECT_LE(run_in_double("T1 Gamma 1000", "direct_rod", 32).error, 0.0025);
  EXPECT_LE(run_in_double("T3", "direct_rod", 16).error, 0.001);
}

TEST(AnalyticTests, ABeadBendsHairAsAnEndLoad) {
  EXPECT_TRUE(has_physics(**find_solver("direct_rod"), test_named("T2 alpha 2")));
  EXPECT_FALSE(has_physics(**find_solver("articulated"), test_named("T2 alpha 2"))) << "no bead";
  for (const char* name : {"T2 alpha 2", "T2 alpha 10"})
    EXPECT_LE(run_in_double(name, "direct_rod", 32).error, 0.0025) << name;
}

// The formula is that of a spring with its weight on the axis: within a few percent.
TEST(AnalyticTests, ACurlWithTwistIsASpring) {
  const AnalyticResult curl = run_in_double("T12", "articulated", kCurlVertices);
  EXPECT_LE(curl.error, 0.05) << curl.value << " instead of " << curl.exact;
}

TEST(AnalyticTests, ThePaperChainFallsAsTheConvergedOne) {
  EXPECT_LE(run_in_double("T18", "direct_rod", 30).error, 0.02);
  EXPECT_GE(run_in_double("T18", "dftl", 30).error, 0.02) << "DFTL falls too slowly";
}

TEST(AnalyticTests, WhatCannotBeRunSaysWhy) {
  RunSetting setting{*find_solver("direct_rod"), Material::Hair, 1000, 60.0};
  const AnalyticResult result = test_named("T1 Gamma 10").run({}, setting);
  EXPECT_TRUE(std::isnan(result.error));
  EXPECT_THAT(result.note, testing::HasSubstr("1000 vertices"));
}

}  // namespace
}  // namespace strandcast::analytic_tests_test
