#include "common/gl/pass_plan.h"

#include <random>
#include <set>

namespace strandcast::gl {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

struct World {
  std::vector<PassDeclaration> passes;
  std::vector<ResourceDeclaration> resources;
  std::vector<std::string> external;
  std::vector<std::string> wanted;

  Result<PassPlan> plan() const { return make_pass_plan(passes, resources, external, wanted); }
};

/// groom -> integrate -> strands -> density -> fog -> picture, and strands -> picture.
World small_world() {
  return {{{"integrate", true, "", {"groom"}, {"strands"}},
           {"splat", true, "", {"strands"}, {"density"}},
           {"fog", true, "", {"density"}, {"haze"}},
           {"draw", true, "", {"strands"}, {"picture"}}},
          {{"strands", 100}, {"density", 1000}, {"haze", 500}, {"picture", 10}},
          {"groom"},
          {"picture"}};
}

TEST(PassPlan, KeepsWhatFeedsTheWantedAndNothingElse) {
  const auto plan = small_world().plan();
  ASSERT_TRUE(plan) << plan.error().to_string();
  EXPECT_TRUE(plan->runs("integrate"));
  EXPECT_TRUE(plan->runs("draw"));
  EXPECT_FALSE(plan->runs("splat"));
  EXPECT_FALSE(plan->runs("fog"));
  EXPECT_THAT(plan->live_resources, ElementsAre("strands", "picture"));
  EXPECT_EQ(plan->live_bytes, 110u);
  EXPECT_EQ(plan->saved_bytes, 1500u);
  ASSERT_EQ(plan->passes.size(), 4u);
  EXPECT_EQ(plan->passes[0].name, "integrate") << "decisions keep the order of declaration";
  EXPECT_EQ(plan->passes[2].fate, PassFate::Unread);
  EXPECT_THAT(plan->passes[2].reason, HasSubstr("haze"));
}

TEST(PassPlan, DisablingAPassRemovesWhatOnlyItFeedsOn) {
  World world = small_world();
  world.wanted = {"picture", "haze"};
  ASSERT_TRUE(world.plan()->runs("splat"));
  world.passes[2].is_enabled = false;
  world.passes[2].disabled_reason = "the scene has no fog";
  const auto plan = world.plan();
  ASSERT_TRUE(plan) << plan.error().to_string();
  EXPECT_EQ(plan->passes[2].fate, PassFate::NotRequested);
  EXPECT_EQ(plan->passes[2].reason, "the scene has no fog");
  EXPECT_EQ(plan->passes[1].fate, PassFate::Unread);
  EXPECT_TRUE(plan->runs("draw"));
}

TEST(PassPlan, WantingNothingRunsNothing) {
  World world = small_world();
  world.wanted.clear();
  const auto plan = world.plan();
  ASSERT_TRUE(plan);
  for (const PassDecision& decision : plan->passes) EXPECT_EQ(decision.fate, PassFate::Unread);
  EXPECT_EQ(plan->live_bytes, 0u);
  EXPECT_EQ(plan->saved_bytes, 1610u);
}

TEST(PassPlan, EveryWriterBeforeAReaderRunsAndWritersAfterTheLastReaderDoNot) {
  const World world{{{"early", true, "", {}, {"sum"}},
                     {"more", true, "", {"sum"}, {"sum"}},
                     {"use", true, "", {"sum"}, {"out"}},
                     {"late", true, "", {"sum"}, {"sum"}}},
                    {{"sum", 1}, {"out", 1}},
                    {},
                    {"out"}};
  const auto plan = world.plan();
  ASSERT_TRUE(plan) << plan.error().to_string();
  EXPECT_TRUE(plan->runs("early") && plan->runs("more") && plan->runs("use"));
  EXPECT_FALSE(plan->runs("late"));
}

TEST(PassPlan, AReadWithoutARunningWriterIsAnError) {
  World world = small_world();
  world.passes[0].is_enabled = false;
  auto plan = world.plan();
  ASSERT_FALSE(plan);
  EXPECT_THAT(plan.error().message, HasSubstr("'draw' reads 'strands'"));
  world.external.push_back("strands");
  EXPECT_TRUE(world.plan());
  world = small_world();
  std::swap(world.passes[0], world.passes[3]);  // drawn before it is simulated
  EXPECT_FALSE(world.plan());
}

TEST(PassPlan, RefusesDuplicatesAndUndeclaredNames) {
  World world = small_world();
  world.passes[1].name = "draw";
  EXPECT_THAT(world.plan().error().message, HasSubstr("pass 'draw' is declared twice"));
  world = small_world();
  world.resources.push_back({"haze", 1});
  EXPECT_THAT(world.plan().error().message, HasSubstr("resource 'haze' is declared twice"));
  world = small_world();
  world.passes[3].reads.push_back("shadow");
  EXPECT_THAT(world.plan().error().message, HasSubstr("undeclared resource 'shadow'"));
  world = small_world();
  world.wanted.push_back("movie");
  EXPECT_THAT(world.plan().error().message, HasSubstr("'movie'"));
}

/// Random chains: what runs is exactly what a walk over the definition finds.
TEST(PassPlan, RandomPlansObeyTheirLaws) {
  std::mt19937 random(7);
  int plans = 0;
  for (int trial = 0; trial < 300; ++trial) {
    World world;
    const int resource_count = 8;
    for (int i = 0; i < resource_count; ++i) world.resources.push_back({fmt::format("r{}", i), 1});
    world.external = {"r0"};
    for (int i = 0; i < 10; ++i) {
      PassDeclaration pass{fmt::format("p{}", i), random() % 8 != 0, "off", {}, {}};
      pass.reads = {fmt::format("r{}", random() % 4), fmt::format("r{}", random() % resource_count)};
      pass.writes = {fmt::format("r{}", 1 + random() % (resource_count - 1))};
      world.passes.push_back(pass);
    }
    world.wanted = {fmt::format("r{}", 1 + random() % (resource_count - 1))};
    const auto plan = world.plan();
    if (!plan) continue;
    ++plans;
    std::set<std::string> available(world.external.begin(), world.external.end());
    for (size_t i = 0; i < world.passes.size(); ++i) {
      const PassDeclaration& pass = world.passes[i];
      bool is_read_later = pass.writes[0] == world.wanted[0];
      for (size_t j = i + 1; j < world.passes.size(); ++j)
        for (const std::string& name : world.passes[j].reads)
          is_read_later = is_read_later || (plan->runs(world.passes[j].name) && name == pass.writes[0]);
      EXPECT_EQ(plan->runs(pass.name), pass.is_enabled && is_read_later);
      if (!plan->runs(pass.name)) continue;
      for (const std::string& name : pass.reads) EXPECT_TRUE(available.contains(name));
      available.insert(pass.writes.begin(), pass.writes.end());
      EXPECT_TRUE(plan->is_live(pass.writes[0]));
    }
    EXPECT_EQ(plan->live_bytes + plan->saved_bytes, static_cast<uint64_t>(resource_count));
  }
  EXPECT_GT(plans, 50) << "too few valid plans to prove anything";
}

}  // namespace
}  // namespace strandcast::gl
