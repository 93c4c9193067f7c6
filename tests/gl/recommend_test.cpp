// What strandcast-report recommends for a scene.
#include <cmath>
#include <map>
#include <set>

#include "common/scene/scene_file.h"
#include "server/report/recommend.h"
#include "server/report/report_executor.h"
#include "tests/support/sim_devices.h"

namespace strandcast::recommend_test {
namespace {

using testing::HasSubstr;

SceneDesc small_scene() {
  return built_in_scene_with({"groom.procedural.strand_count=64", "groom.procedural.vertex_count=12"})
      .value();
}

RecommendOptions options_for(double budget_ms) {
  RecommendOptions options;
  options.budget_ms = budget_ms;
  options.solvers = {"dftl", "direct_rod"};
  return options;
}

TEST(Recommend, WithTimeEnoughItNamesTheRodInLinesThatASceneTakes) {
  constexpr double kAmpleMs = 1e4;
  const SceneDesc scene = small_scene();
  const auto found = recommend(scene, options_for(kAmpleMs));
  ASSERT_TRUE(found) << found.error().to_string();
  EXPECT_EQ(found->strand_count, 64u);
  EXPECT_EQ(found->vertex_count, 12u);
  const Candidate& best = found->fitting.front();
  EXPECT_EQ(best.setting.row->name, "direct_rod");
  EXPECT_GT(best.ms_per_step, 0.0);
  for (const Candidate& candidate : found->fitting) EXPECT_GE(candidate.error, best.error);

  const auto pasted = parse_scene("name: \"pasted\"\n" + found->scene_lines, "pasted", {});
  ASSERT_TRUE(pasted) << pasted.error().to_string();
  EXPECT_EQ(pasted->solver.name, "direct_rod");
  EXPECT_EQ(pasted->substeps, best.setting.substeps);
  const auto complete = complete_parameters(*best.setting.row, pasted->solver.parameters);
  ASSERT_TRUE(complete) << complete.error().to_string();
  EXPECT_EQ(complete->at("solves"), best.setting.effort);

  const std::string text = recommendation_text(*found, scene, kAmpleMs);
  EXPECT_THAT(text, HasSubstr("Take direct_rod"));
  EXPECT_THAT(text, HasSubstr(found->scene_lines));
  EXPECT_EQ(found->hair, MotionHair::Styled) << "the built-in hair falls over the head";
  EXPECT_THAT(text, HasSubstr("errors are not, but of styled hair of 0.25 m"));
}

// The same setting has one error, whatever runs it, and a time on each executor; the text says which.
TEST(Recommend, OnEveryExecutorItSaysWhichATimeIsOf) {
  constexpr double kAmpleMs = 1e4;
  const SceneDesc scene = small_scene();
  RecommendOptions options = options_for(kAmpleMs);
  options.solvers = {"dftl"};
  options.device.sim_device = kAllDevices;
  const auto found = recommend(scene, options);
  ASSERT_TRUE(found) << found.error().to_string();
  ASSERT_EQ(found->executors.size(), sim_devices().size());
  std::map<std::string, std::vector<Candidate>> by_setting;
  for (const Candidate& candidate : found->fitting)
    by_setting[to_string(candidate.setting)].push_back(candidate);
  for (const auto& [setting, candidates] : by_setting) {
    SCOPED_TRACE(setting);
    std::set<SimDevice> devices;
    for (const Candidate& candidate : candidates) {
      devices.insert(candidate.device);
      EXPECT_EQ(candidate.error, candidates.front().error);
      EXPECT_GE(candidate.ms_per_step, candidates.front().ms_per_step) << "of equals the fastest first";
    }
    EXPECT_EQ(devices.size(), sim_devices().size());
  }
  const std::string device = to_string(found->fitting.front().device);
  const std::string text = recommendation_text(*found, scene, kAmpleMs);
  EXPECT_THAT(text, HasSubstr(" on " + device + ": of the "));
  EXPECT_THAT(text, HasSubstr("strandcast-server --sim-device " + device));
  for (const ExecutorInfo& executor : found->executors) EXPECT_THAT(text, HasSubstr(executor.name));
}

TEST(Recommend, SaysWhatWouldFitWhenNothingDoes) {
  const auto found = recommend(small_scene(), options_for(1e-7));
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, ErrorCode::LimitExceeded);
  EXPECT_THAT(found.error().message, HasSubstr("nothing fits 1e-07 ms per step: the fastest, "));
  EXPECT_THAT(found.error().message, HasSubstr("64 strands of 12 vertices"));
}

TEST(Recommend, RefusesBudgetsAndModelsThatAreNone) {
  for (const double budget_ms : {0.0, -1.0, std::nan("")})
    EXPECT_EQ(recommend(small_scene(), options_for(budget_ms)).error().code, ErrorCode::BadInput);
  RecommendOptions options = options_for(1.0);
  options.solvers = {"nonsense"};
  EXPECT_THAT(recommend(small_scene(), options).error().message, HasSubstr("unknown solver 'nonsense'"));
}

}  // namespace
}  // namespace strandcast::recommend_test
