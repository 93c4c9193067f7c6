// Every scene that ships, as a person would run it.
#include <algorithm>
#include <set>

#include "common/groom/groom_file.h"
#include "common/groom/head_fit.h"
#include "common/groom/head_shape.h"
#include "common/groom/mesh.h"
#include "common/scene/features.h"
#include "common/scene/scene_file.h"
#include "tests/support/shared_data.h"

namespace strandcast::deploy_scenes_test {
namespace {

using testing::HasSubstr;

std::filesystem::path scene_path(const std::string& name) {
  return std::filesystem::path(STRANDCAST_SOURCE_DIR) / "deploy" / "scenes" / (name + ".textproto");
}

std::filesystem::path data_path(const std::string& name) {
  return std::filesystem::path(STRANDCAST_SHARED_DATA) / name;
}

/// Scenes that need a file of the person's own, with one that fits.
const std::map<std::string, std::string>& groom_files() {
  static const std::map<std::string, std::string> kFiles{{"mohawk", "grooms/Ratboy_mohawk.tfx"},
                                                         {"sintel", "grooms/sintel_11400x16.tfx"}};
  return kFiles;
}

SceneDesc loaded(const std::string& name, const std::vector<std::string>& overrides = {}) {
  const auto scene = load_scene(scene_path(name), overrides);
  EXPECT_TRUE(scene) << scene.error().to_string();
  return scene ? *scene : SceneDesc{};
}

TEST(DeployScenes, EveryFileParsesAndHasAName) {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(scene_path("x").parent_path())) {
    ASSERT_EQ(entry.path().extension(), ".textproto") << entry.path();
    const std::string stem = entry.path().stem().string();
    std::vector<std::string> overrides;
    if (groom_files().contains(stem)) overrides.push_back("groom.file.path=some.tfx");
    const SceneDesc scene = loaded(stem, overrides);
    EXPECT_TRUE(names.insert(scene.name).second) << scene.name;
    EXPECT_EQ(parse_scene(to_text(scene), "again", {}).value(), scene);
  }
  EXPECT_GE(names.size(), 9u);
}

TEST(DeployScenes, DefaultIsTheBuiltInScene) {
  EXPECT_EQ(loaded("default"), built_in_scene_with({"quality=auto"}).value());
  EXPECT_EQ(loaded("default", {"quality=fast"}).solver, built_in_scene_with({"quality=fast"})->solver);
}

TEST(DeployScenes, MinimalNeedsNothing) {
  EXPECT_EQ(analyse(loaded("minimal"), {}), SceneFeatures{});
}

TEST(DeployScenes, BenchScenesHaveTheSizesInTheirNames) {
  const std::map<std::string, std::pair<uint32_t, uint32_t>> sizes{{"bench_242x8", {242, 8}},
                                                                   {"bench_1kx16", {1000, 16}},
                                                                   {"bench_1kx32", {1000, 32}},
                                                                   {"bench_10kx16", {10'000, 16}},
                                                                   {"bench_10kx32", {10'000, 32}}};
  for (const auto& [name, size] : sizes) {
    const SceneDesc scene = loaded(name);
    const auto& groom = std::get<ProceduralGroomDesc>(scene.groom);
    EXPECT_EQ(groom.strand_count, size.first) << name;
    EXPECT_EQ(groom.vertex_count, size.second) << name;
    EXPECT_TRUE(analyse(scene, {}).has_colliders) << name;
    EXPECT_FALSE(analyse(scene, {}).has_wind) << name;
  }
}

TEST(DeployScenes, ScenesForFilesSayHowToNameTheFile) {
  for (const auto& [name, file] : groom_files()) {
    const auto scene = load_scene(scene_path(name), {});
    ASSERT_FALSE(scene) << name;
    EXPECT_THAT(scene.error().to_string(), HasSubstr(name + ".textproto"));
    EXPECT_THAT(scene.error().to_string(), HasSubstr("--set groom.file.path="));
  }
}

/// Hair in head space of a shipped scene with its real file.
Groom real_groom(const std::string& name) {
  const SceneDesc scene = loaded(name, {"groom.file.path=" + data_path(groom_files().at(name)).string()});
  const auto& file = std::get<FileGroomDesc>(scene.groom);
  GroomFileOptions options;
  options.path = file.path;
  options.unit_m = file.unit_m;
  options.is_z_up = file.up_axis == UpAxis::Z;
  EXPECT_TRUE(file.has_up_axis && file.has_yaw && file.has_origin) << "nothing of it is guessed";
  options.yaw_deg = file.yaw_deg;
  options.origin = file.origin;
  options.vertex_count = file.vertex_count;
  const auto groom = load_groom(options);
  EXPECT_TRUE(groom) << groom.error().to_string();
  return groom ? *groom : Groom{};
}

TEST(DeployScenes, SintelsHeadJointIsTheCentreOfHerSkull) {
  REQUIRE_SHARED(data_path(groom_files().at("sintel")));
  const FittedSphere skull = fit_sphere(roots_of(real_groom("sintel")));
  EXPECT_LT(glm::length(skull.center_m), 0.003f);
  EXPECT_NEAR(skull.radius_m, 0.0926f, 0.001f);
}

TEST(DeployScenes, TheMohawkFitsAHumanHead) {
  REQUIRE_SHARED(data_path(groom_files().at("mohawk")));
  const SceneDesc scene = loaded("mohawk", {"groom.file.path=x"});
  std::vector<glm::vec3> crest;  // roots on the skull, not down the back
  const Groom groom = real_groom("mohawk");
  for (const glm::vec3& root : roots_of(groom))
    if (root.y > 0.005f) crest.push_back(root);
  ASSERT_GT(crest.size(), 500u);
  const FittedSphere skull = fit_sphere(crest);
  EXPECT_LT(glm::length(skull.center_m), 0.005f);
  EXPECT_NEAR(skull.radius_m, 0.095f, 0.005f) << "an adult head";
  EXPECT_TRUE(scene.colliders.empty() && scene.has_auto_collider) << "what is drawn is what collides";
  // The head that is drawn lies under the roots.
  const HeadShape head(groom, fit_head(groom), HeadFit::Whole);
  for (const glm::vec3& root : crest) {
    EXPECT_GT(head.distance_m(root), -0.004);
    EXPECT_LT(head.distance_m(root), 0.02);
  }
}

}  // namespace
}  // namespace strandcast::deploy_scenes_test
