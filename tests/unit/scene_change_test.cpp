// Changing a scene while it runs: what is live, and what a change takes along.
#include "server/source/scene_change.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/scene/scene_file.h"
#include "common/wire/messages.h"
#include "server/sim/solver_registry.h"

namespace strandcast::scene_change_test {
namespace {

using testing::HasSubstr;
using testing::Not;

std::string error_of(const Result<SceneDesc>& result) {
  return result.ok() ? "no error" : result.error().to_string();
}

TEST(SceneChange, ChangesLiveFieldsOnly) {
  const SceneDesc scene = built_in_scene();
  const auto windy = change_scene(scene, "wind.mean_mps.x=4");
  ASSERT_TRUE(windy.ok()) << windy.error().to_string();
  EXPECT_EQ(windy->wind.mean_mps.x, 4.0f);
  EXPECT_THAT(error_of(change_scene(scene, "groom.procedural.strand_count=3")), HasSubstr("known: solver"));
  const auto coarser = change_scene(scene, "stream.bound_m=0.0002");
  ASSERT_TRUE(coarser.ok()) << coarser.error().to_string();
  EXPECT_EQ(coarser->stream.bound_m, 0.0002f);
  const auto freer = change_scene(scene, "follicle_limit_deg=180");
  ASSERT_TRUE(freer) << freer.error().to_string();
  EXPECT_EQ(freer->follicle_limit_deg, 180.0);
  EXPECT_FALSE(change_scene(scene, "follicle_limit_deg=181"));
  const auto rarer = change_scene(scene, "stream.strand_rate_hz=20");
  ASSERT_TRUE(rarer.ok()) << rarer.error().to_string();
  EXPECT_EQ(rarer->stream.strand_rate_hz, 20.0);
  for (const char* wrong : {"stream.strand_rate_hz=-1", "stream.strand_rate_hz=1000.5"})
    EXPECT_THAT(error_of(change_scene(scene, wrong)), HasSubstr("0 .. 1000")) << wrong;
  EXPECT_THAT(error_of(change_scene(scene, "stream.codec=raw")), HasSubstr("'stream.codec' cannot change"));
  EXPECT_THAT(error_of(change_scene(scene, "a=b")), Not(HasSubstr("cannot change")));
  EXPECT_THAT(error_of(change_scene(scene, "")), HasSubstr("known: solver"));
  // What is wrong is told by the assignment, and by no option of the server that nobody gave.
  EXPECT_THAT(error_of(change_scene(scene, "substeps=0")), testing::StartsWith("substeps=0: substeps is 0"));
  EXPECT_THAT(error_of(change_scene(scene, "wind.gusts=1")),
              testing::StartsWith("wind.gusts=1: wind has no field"));
}

TEST(SceneChange, LookAndCameraAreLive) {
  const SceneDesc scene = built_in_scene();
  const auto changed = [&](const std::string& assignment) {
    const auto result = change_scene(scene, assignment);
    EXPECT_TRUE(result) << result.error().to_string();
    return result ? *result : SceneDesc{};
  };
  EXPECT_EQ(changed("look.hair_color=red").look.hair_color, "red");
  EXPECT_EQ(changed("look.shading.wetness=0.5").look.shading.wetness, 0.5f);
  EXPECT_EQ(changed("camera.fov_y_rad=0.9").camera.fov_y_rad, 0.9f);
  // Several at once, and the others stay.
  const SceneDesc several = changed("look={ style { clump: 0.25 } rim_color { r: 1 } }");
  EXPECT_EQ(several.look.style.clump, 0.25f);
  EXPECT_EQ(several.look.style.locks, scene.look.style.locks);
  EXPECT_EQ(several.look.rim_color, glm::vec3(1.0f, scene.look.rim_color.g, scene.look.rim_color.b));
  for (const auto& [wrong, part] : std::vector<std::pair<std::string, std::string>>{
           {"look.shading.wetness=1.5", "look.shading.wetness is 1.5, it must be within 0 .. 1"},
           {"look.ambient=nan", "look.ambient is nan, it must be within 0 .. 1"},
           {"look.hair_color=purple", "look.hair_color must be custom, melanin, black"},
           {"look.light_direction={ x: 0 y: 0 z: 0 }", "look.light_direction must point somewhere"},
           {"look.rim_direction={ x: 0 y: 0 z: 0 }", "look.rim_direction must point somewhere"},
           {"look.shine=1", "look has no field \"shine\" (known: root_color"},
           {"look", "expected path=value"},
           {"camera.offset_m={ x: 0 y: 0 z: 0 }", "camera.offset_m is almost zero"}})
    EXPECT_THAT(error_of(change_scene(scene, wrong)), HasSubstr(part)) << wrong;
  // However much was said, the sentence says what is wrong with it.
  std::string longest = "look={";
  while (longest.size() < 3'000) longest += " style { clump: 0.5 }";
  EXPECT_THAT(error_of(change_scene(scene, longest + " ambient: 2 }")).substr(0, kMaxTextChars),
              HasSubstr("look.ambient is 2, it must be within 0 .. 1"));
}

TEST(SceneChange, NamesKnownSolversAndRanges) {
  const SceneDesc scene = built_in_scene();
  EXPECT_THAT(error_of(change_scene(scene, "solver.name=spaghetti")), HasSubstr("known: dftl"));
  EXPECT_THAT(error_of(change_scene(scene, "solver.parameters.nonsense=1")), HasSubstr("known: "));
  EXPECT_THAT(error_of(change_scene(scene, "solver.parameters.s_damping=17")), HasSubstr("17"));
  EXPECT_THAT(error_of(change_scene(scene, "wind.nonsense=1")), HasSubstr("nonsense"));
}

TEST(SceneChange, EverySolverCanBeChosenFromEveryOtherWithItsParametersSet) {
  for (const SolverRow& from : solver_table()) {
    SceneDesc scene = built_in_scene();
    scene.solver.name = from.name;
    for (const SolverParameterInfo& info : from.parameters)
      scene.solver.parameters[info.name] = info.default_value;
    for (const SolverRow& to : solver_table()) {
      const auto changed = change_scene(scene, "solver.name=" + to.name);
      ASSERT_TRUE(changed.ok()) << changed.error().to_string();
      EXPECT_EQ(changed->solver.name, to.name);
    }
  }
}

TEST(SceneChange, SaysWhatANewSolverDoesNotTake) {
  SceneDesc scene = built_in_scene();
  scene.solver = {"xpbd", {{"iterations", 20.0}, {"sag_free", 0.5}}};
  const auto changed = change_scene(scene, "solver.name=dftl");
  ASSERT_TRUE(changed.ok()) << changed.error().to_string();
  EXPECT_EQ(changed->solver.parameters, (std::map<std::string, double>{{"sag_free", 0.5}}));
  EXPECT_EQ(left_out_note(scene, *changed), "solver dftl does not take iterations 20: left out");
  EXPECT_EQ(left_out_note(scene, scene), "");
}

// A model that cannot bear what a scene asks for besides goes on without, and that is said; who asks for both
// is refused.
TEST(SceneChange, LeavesOutWhatANewSolverCannotBear) {
  SceneDesc scene = built_in_scene();
  scene.volume.friction_per_s = 20.0;
  scene.bend_limit.most_tip_deg = 60.0;
  scene.wind.along_share = 0.5f;
  const auto follow = change_scene(scene, "solver.name=ftl");
  ASSERT_TRUE(follow.ok()) << follow.error().to_string();
  EXPECT_FALSE(follow->volume.acts());
  EXPECT_TRUE(follow->bend_limit.acts());
  EXPECT_THAT(left_out_note(scene, *follow), HasSubstr("solver ftl does not take"));
  EXPECT_THAT(left_out_note(scene, *follow), HasSubstr("forces between strands (volume): left out"));
  EXPECT_THAT(change_scene(*follow, "volume.friction_per_s=20").error().to_string(),
              HasSubstr("solver ftl takes no forces between strands"));
  const auto reference = change_scene(scene, "solver.name=super_helix");
  ASSERT_TRUE(reference.ok()) << reference.error().to_string();
  EXPECT_FALSE(reference->volume.acts() || reference->bend_limit.acts());
  EXPECT_EQ(reference->wind.along_share, 1.0f);
  EXPECT_THAT(left_out_note(scene, *reference), HasSubstr("wind.along_share"));
  EXPECT_THAT(change_scene(*reference, "wind.along_share=0.5").error().to_string(),
              HasSubstr("solver super_helix has no kernel and knows no drag by direction"));
  EXPECT_THAT(change_scene(*reference, "bend_limit.most_tip_deg=60").error().to_string(),
              HasSubstr("solver super_helix has no kernel and takes no bend_limit"));
}

TEST(SceneChange, StepsOutsideTheStableRangeAreRefusedWhateverChangesThem) {
  SceneDesc scene = built_in_scene();
  scene.solver.name = "mass_spring";
  scene.solver.parameters = {{"integrator", 1.0},
                             {"linear_density_kg_per_m", 0.1},
                             {"shortest_segment_m", 0.01},
                             {"stretch_stiffness_n_per_m", 1.0},
                             {"stretch_damping_ns_per_m", 0.0},
                             {"altitude_stiffness_n_per_m", 0.0},
                             {"bend_stiffness_nm_per_rad", 0.0}};
  scene.step_rate_hz = 60.0;
  scene.substeps = 1;
  ASSERT_TRUE(check_solver(scene));  // up to 0.001 kg / (1/60 s)^2 = 3.6 N/m
  EXPECT_THAT(error_of(change_scene(scene, "solver.parameters.stretch_stiffness_n_per_m=3.7")),
              HasSubstr("up to 3.6 N/m"));
  scene.substeps = 4;
  scene.solver.parameters["stretch_stiffness_n_per_m"] = 50.0;
  ASSERT_TRUE(check_solver(scene));
  EXPECT_THAT(error_of(change_scene(scene, "substeps=3")), HasSubstr("too stiff"));
  scene.solver.parameters["integrator"] = 2.0;
  EXPECT_TRUE(change_scene(scene, "substeps=1").ok());
}

}  // namespace
}  // namespace strandcast::scene_change_test
