#include "common/gl/pass_plan.h"

#include <random>
#include <set>

namespace strandcast::gl::pass_plan_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

struct World {
  std::vector<std::unique_ptr<Resource>> resources;
  std::vector<PassDeclaration> passes;
  Resources external;
  Resources wanted;

  const Resource* add(const std::string& name, uint64_t size_bytes) {
    return resources.emplace_back(std::make_unique<Resource>(name, size_bytes)).get();
  }
  const Resource* operator[](const std::string& name) const {
    for (const auto& resource : resources)
      if (resource->name() == name) return resource.get();
    return nullptr;
  }
  Result<PassPlan> plan() const { return make_pass_plan(passes, external, wanted); }
};

/// groom -> integrate -> strands -> density -> fog -> picture, and strands -> picture.
World small_world() {
  World world;
  const Resource* groom = world.add("groom", 7);
  const Resource* strands = world.add("strands", 100);
  const Resource* density = world.add("density", 1000);
  const Resource* haze = world.add("haze", 500);
  const Resource* picture = world.add("picture", 10);
  world.passes = {{"integrate", {groom}, {strands}, true, ""},
                  {"splat", {strands}, {density}, true, ""},
                  {"fog", {density}, {haze}, true, ""},
                  {"draw", {strands}, {picture}, true, ""}};
  world.external = {groom};
  world.wanted = {picture};
  return world;
}

TEST(PassPlan, KeepsWhatFeedsTheWantedAndNothingElse) {
  const World world = small_world();
  const auto plan = world.plan();
  ASSERT_TRUE(plan) << plan.error().to_string();
  EXPECT_TRUE(plan->runs("integrate"));
  EXPECT_TRUE(plan->runs("draw"));
  EXPECT_FALSE(plan->runs("splat"));
  EXPECT_FALSE(plan->runs("fog"));
  EXPECT_THAT(plan->live, ElementsAre(world["strands"], world["picture"])) << "the groom is not ours";
  EXPECT_EQ(plan->live_bytes, 110u);
  EXPECT_EQ(plan->saved_bytes, 1500u);
  ASSERT_EQ(plan->passes.size(), 4u);
  EXPECT_EQ(plan->passes[0].name, "integrate") << "decisions keep the order of declaration";
  EXPECT_EQ(plan->passes[0].reason, "writes strands for draw");
  EXPECT_EQ(plan->passes[3].reason, "writes picture for the outside");
  EXPECT_EQ(plan->passes[2].fate, PassFate::Unread);
  EXPECT_THAT(plan->passes[2].reason, HasSubstr("haze"));
}

TEST(PassPlan, DisablingAPassRemovesWhatOnlyItFeedsOn) {
  World world = small_world();
  world.wanted.push_back(world["haze"]);
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
  World world;
  const Resource* sum = world.add("sum", 1);
  const Resource* out = world.add("out", 1);
  world.passes = {{"early", {}, {sum}, true, ""},
                  {"more", {sum}, {sum}, true, ""},
                  {"use", {sum}, {out}, true, ""},
                  {"late", {sum}, {sum}, true, ""}};
  world.wanted = {out};
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
  world.external.push_back(world["strands"]);
  EXPECT_TRUE(world.plan());
  world = small_world();
  std::swap(world.passes[0], world.passes[3]);  // drawn before it is simulated
  EXPECT_FALSE(world.plan());
}

TEST(PassPlan, RefusesTwoOfOneName) {
  World world = small_world();
  world.passes[1].name = "draw";
  EXPECT_THAT(world.plan().error().message, HasSubstr("pass 'draw' is declared twice"));
  world = small_world();
  world.passes[3].reads.push_back(world.add("haze", 1));
  EXPECT_THAT(world.plan().error().message, HasSubstr("two resources are called 'haze'"));
}

/// Random chains: what runs is exactly what a walk over the definition finds.
TEST(PassPlan, RandomPlansObeyTheirLaws) {
  std::mt19937 random(7);
  int plans = 0;
  for (int trial = 0; trial < 300; ++trial) {
    World world;
    const int resource_count = 8;
    for (int i = 0; i < resource_count; ++i) world.add(fmt::format("r{}", i), 1);
    const auto resource = [&](size_t i) { return world.resources[i].get(); };
    world.external = {resource(0)};
    for (int i = 0; i < 10; ++i) {
      PassDeclaration pass{fmt::format("p{}", i), {}, {}, random() % 8 != 0, "off"};
      pass.reads = {resource(random() % 4), resource(random() % resource_count)};
      pass.writes = {resource(1 + random() % (resource_count - 1))};
      world.passes.push_back(pass);
    }
    world.wanted = {resource(1 + random() % (resource_count - 1))};
    const auto plan = world.plan();
    if (!plan) continue;
    ++plans;
    std::set<const Resource*> available(world.external.begin(), world.external.end());
    for (size_t i = 0; i < world.passes.size(); ++i) {
      const PassDeclaration& pass = world.passes[i];
      bool is_read_later = pass.writes[0] == world.wanted[0];
      for (size_t j = i + 1; j < world.passes.size(); ++j)
        for (const Resource* read : world.passes[j].reads)
          is_read_later = is_read_later || (plan->runs(world.passes[j].name) && read == pass.writes[0]);
      EXPECT_EQ(plan->runs(pass.name), pass.is_enabled && is_read_later);
      if (!plan->runs(pass.name)) continue;
      for (const Resource* read : pass.reads) EXPECT_TRUE(available.contains(read));
      available.insert(pass.writes.begin(), pass.writes.end());
      EXPECT_TRUE(plan->is_live(*pass.writes[0]));
    }
    std::set<const Resource*> named;
    for (const PassDeclaration& pass : world.passes) {
      named.insert(pass.reads.begin(), pass.reads.end());
      named.insert(pass.writes.begin(), pass.writes.end());
    }
    named.erase(resource(0));  // from outside, costs nothing here
    EXPECT_EQ(plan->live_bytes + plan->saved_bytes, named.size());
  }
  EXPECT_GT(plans, 50) << "too few valid plans to prove anything";
}

}  // namespace
}  // namespace strandcast::gl::pass_plan_test
