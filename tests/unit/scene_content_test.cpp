// Loading what a scene names: grown and real grooms, the collider under them, and clear errors.
#include "server/scene/scene_content.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "common/base/quantile.h"
#include "common/groom/head_fit.h"
#include "common/groom/head_measure.h"
#include "common/groom/head_spheres.h"
#include "tests/support/groom_files.h"
#include "tests/support/shared_data.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::scene_content_test {
namespace {

/// How deep the deepest vertex of the hair as loaded lies in what collides, m.
double deepest_m(const SceneContent& content) {
  double deepest_m = 0.0;
  for (const glm::vec3& point : content.groom.rest_position_m)
    for (const SphereCollider& sphere : content.colliders)
      deepest_m = std::max(deepest_m, static_cast<double>(sphere.radius_m) -
                                          glm::length(glm::dvec3(point) - glm::dvec3(sphere.center_m)));
  return deepest_m;
}

std::vector<FittedSphere> spheres_of(const SceneContent& content) {
  std::vector<FittedSphere> spheres;
  for (const SphereCollider& collider : content.colliders)
    spheres.push_back({collider.center_m, collider.radius_m});
  return spheres;
}

const double kMostSwallowedM = 1.001 * static_cast<double>(kSwallowedM);  // but for rounding

TEST(SceneContent, BuiltInSceneIsUniformAndRestsOnItsCollider) {
  const SceneDesc scene = built_in_scene();
  const auto content = load_scene_content(scene);
  ASSERT_TRUE(content.ok()) << content.error().to_string();
  const auto& procedural = std::get<ProceduralGroomDesc>(scene.groom);
  EXPECT_EQ(content->groom.strand_count(), procedural.strand_count);
  EXPECT_EQ(content->groom.uniform_vertex_count(), procedural.vertex_count);
  EXPECT_FALSE(content->head.triangle.empty());
  ASSERT_EQ(content->colliders.size(), kHeadSpheres);
  EXPECT_NEAR(content->colliders[0].radius_m, scene.head.radius_m, 0.1f * scene.head.radius_m);
  EXPECT_LE(deepest_m(*content), kMostSwallowedM);
  const HeadMeasure measure = measure_head(content->head, spheres_of(*content), content->groom);
  EXPECT_LT(measure.root_most_m, 0.003);
  EXPECT_LT(measure.sphere_median_m, 0.003);
  // Where hair lies on it, at the back without the ears and the rim of the neck, skin and spheres are one.
  std::vector<double> apart_m;
  for (const glm::vec3& point : content->head.position_m)
    if (point.z < 0.0f && std::abs(point.x) < 0.085f && point.y > -0.18f)
      apart_m.push_back(std::abs(distance_to_spheres_m(spheres_of(*content), point)));
  ASSERT_GT(apart_m.size(), 200u);
  EXPECT_LT(quantile(apart_m, 0.95), 0.008);
  // The neck collides: its middle lies 120 mm below that of the skull.
  EXPECT_LT(distance_to_spheres_m(spheres_of(*content), {0.0, -0.12, -0.025}), -0.02);
}

TEST(SceneContent, OwnCollidersReplaceTheFittedOneAndNoneMeansNone) {
  SceneDesc scene = built_in_scene();
  scene.head.is_visible = false;
  scene.colliders = {{glm::vec3(0.0f), 0.05f}, {glm::vec3(0.0f, -0.2f, 0.0f), 0.08f}};
  auto content = load_scene_content(scene);
  ASSERT_TRUE(content.ok());
  EXPECT_EQ(content->colliders.size(), 2u);
  EXPECT_TRUE(content->head.triangle.empty());
  scene.colliders.clear();
  scene.has_auto_collider = false;
  content = load_scene_content(scene);
  ASSERT_TRUE(content.ok());
  EXPECT_TRUE(content->colliders.empty());
}

TEST(SceneContent, AHeadThatIsAFieldHasNoSpheresAndIsThatOfItsMesh) {
  SceneDesc scene = built_in_scene();
  EXPECT_EQ(load_scene_content(scene)->head_field, nullptr) << "nobody asked for one";
  scene.head.collider = kFieldCollider;
  scene.head.field_resolution = 32;
  const auto content = load_scene_content(scene);
  ASSERT_TRUE(content.ok()) << content.error().to_string();
  EXPECT_TRUE(content->colliders.empty());
  ASSERT_NE(content->head_field, nullptr);
  const DistanceField& field = *content->head_field;
  for (size_t i = 0; i < content->head.position_m.size(); i += 37)
    EXPECT_NEAR(field.sample(content->head.position_m[i]).distance_m, 0.0, 0.6 * field.cell_m);
  const HairInside inside = measure_inside(field, content->groom);
  ASSERT_EQ(content->notes.size(), 1u);
  EXPECT_EQ(content->notes[0], to_sentence(inside, field));
  EXPECT_LT(inside.deepest_m, 0.01) << "hair that grows on it";
}

TEST(SceneContent, AMeshThatNoFieldCanBeMadeOfIsNamed) {
  const TemporaryFolder folder;
  SceneDesc scene = built_in_scene();
  scene.head.collider = kFieldCollider;
  scene.head.mesh_path = folder.write("sheet.obj", "v -1 0 0\nv 1 0 0\nv 0 0 1\nv 0 0 2\nf 1 2 3\nf 1 3 4\n");
  const auto content = load_scene_content(scene);
  ASSERT_FALSE(content.ok());
  EXPECT_EQ(content.error().code, ErrorCode::BadInput);
  EXPECT_EQ(content.error().to_string().find("head.mesh_path: the mesh "), 0u) << content.error().to_string();
}

TEST(SceneContent, OtherHairIsATargetWhereItIsOnTheSameHead) {
  SceneDesc scene = built_in_scene();
  EXPECT_EQ(load_scene_content(scene)->volume_target, nullptr) << "nobody asked for one";
  scene.target_groom = ProceduralGroomDesc{.strand_count = 100, .vertex_count = 8, .length_m = 0.15f};
  const auto content = load_scene_content(scene);
  ASSERT_TRUE(content.ok()) << content.error().to_string();
  ASSERT_NE(content->volume_target, nullptr);
  EXPECT_EQ(content->volume_target->strand_count(), 100u);

  // A strand of a metre beside a head of ten centimetres.
  const TemporaryFolder folder;
  FileGroomDesc far;
  test::ByteFile hair;
  for (const char letter : std::string("HAIR")) hair.add(letter);
  hair.add(1u).add(2u).add(2u).add(1u).zeros(128 - 20);  // a strand, two points, which is all there is
  for (const float number : {5.0f, 0.0f, 0.0f, 5.0f, -1.0f, 0.0f}) hair.add(number);
  far.path = folder.write("far.hair", hair.text());
  far.unit_m = 1.0f;
  far.has_origin = far.has_up_axis = far.has_yaw = true;
  scene.target_groom = far;
  const auto elsewhere = load_scene_content(scene);
  ASSERT_FALSE(elsewhere.ok());
  EXPECT_EQ(elsewhere.error().code, ErrorCode::BadInput);
  EXPECT_THAT(elsewhere.error().to_string(),
              ::testing::StartsWith(
                  "target_groom: the target's hair lies elsewhere than the scene's: 0 % of its box"));
  far.path = folder.path() / "none.tfx";
  scene.target_groom = far;
  EXPECT_THAT(load_scene_content(scene).error().to_string(), ::testing::StartsWith("target_groom, "));
}

TEST(SceneContent, RealGroomGetsAHeadWhereItsRootsAre) {
  const std::filesystem::path path =
      std::filesystem::path(STRANDCAST_SHARED_DATA) / "grooms/Ratboy_mohawk.tfx";
  REQUIRE_SHARED(path);
  SceneDesc scene = built_in_scene();
  FileGroomDesc file;
  file.path = path;
  file.unit_m = 1.0f;
  scene.groom = file;
  scene.head.radius_m = 0.0f;
  const auto content = load_scene_content(scene);
  ASSERT_TRUE(content.ok()) << content.error().to_string();
  EXPECT_EQ(content->groom.strand_count(), 2'228u);
  EXPECT_FALSE(content->colliders.empty());
  EXPECT_LE(deepest_m(*content), kMostSwallowedM);
  ASSERT_FALSE(content->head.position_m.empty());
}

TEST(SceneContent, HeadStandsWhereTheSceneSays) {
  SceneDesc scene = built_in_scene();
  const auto here = load_scene_content(scene);
  scene.head.has_center = true;
  scene.head.center_m = {0.5f, 0.25f, -1.0f};
  const auto there = load_scene_content(scene);
  ASSERT_TRUE(here.ok() && there.ok());
  for (size_t i = 0; i < here->head.position_m.size(); i += 100)
    EXPECT_LT(glm::distance(here->head.position_m[i] + scene.head.center_m, there->head.position_m[i]),
              1e-6f);
  EXPECT_LT(glm::distance(there->colliders[0].center_m, scene.head.center_m), 0.02f)
      << "the hair comes along";
}

TEST(SceneContent, GroomFileWithoutAnOriginIsCentredOnItsRootsWithItsMesh) {
  const std::filesystem::path data = STRANDCAST_SHARED_DATA;
  FileGroomDesc file;
  file.path = data / "grooms/sintel_11400x16.tfx";
  REQUIRE_SHARED(file.path);
  SceneDesc scene = built_in_scene();
  scene.groom = file;
  scene.head.mesh_path = data / "meshes/sintel.obj";
  const auto content = load_scene_content(scene);
  ASSERT_TRUE(content.ok()) << content.error().to_string();
  EXPECT_LT(glm::length(fit_head(content->groom).center_m), 1e-4f);
  // With the origin that is written into the file's own scene, everything lies in the same place.
  file.has_origin = true;
  file.origin = {0.0f, 1.5646f, -0.0041f};
  scene.groom = file;
  const auto placed = load_scene_content(scene);
  ASSERT_TRUE(placed.ok());
  EXPECT_LT(glm::distance(placed->groom.rest_position_m[0], content->groom.rest_position_m[0]), 1e-3f);
  EXPECT_LT(glm::distance(placed->head.position_m[0], content->head.position_m[0]), 1e-3f);
}

TEST(SceneContent, ManeDownTheBackDoesNotInflateTheHead) {
  const std::filesystem::path path =
      std::filesystem::path(STRANDCAST_SHARED_DATA) / "grooms/Ratboy_mohawk.tfx";
  REQUIRE_SHARED(path);
  SceneDesc scene = built_in_scene();
  FileGroomDesc file;
  file.path = path;
  file.unit_m = 1.0f;
  scene.groom = file;
  scene.head.radius_m = 0.0f;
  const auto content = load_scene_content(scene);
  ASSERT_TRUE(content.ok()) << content.error().to_string();
  // Measured by hand on the roots of the head alone: radius 0.151 file units, against 0.528 for all roots.
  const FittedSphere head = fit_head(content->groom);
  EXPECT_GT(head.radius_m, 0.1f);
  EXPECT_LT(head.radius_m, 0.16f);
  EXPECT_LT(glm::length(head.center_m), 0.01f) << "the head joint is in the middle of the head";
}

TEST(SceneContent, SeveralMeshesAreOneHead) {
  const std::filesystem::path data = STRANDCAST_SHARED_DATA;
  FileGroomDesc file;
  file.path = data / "grooms/sintel_11400x16.tfx";
  REQUIRE_SHARED(file.path);
  SceneDesc scene = built_in_scene();
  scene.groom = file;
  scene.head.mesh_path = data / "meshes/sintel.obj";
  const auto one = load_scene_content(scene);
  scene.head.more_mesh_paths = {data / "meshes/sintel-eyes.obj", data / "meshes/sintel-eyelashes.obj"};
  const auto all = load_scene_content(scene);
  ASSERT_TRUE(one && all);
  EXPECT_GE(all->head.position_m.size(), one->head.position_m.size() + 708u + 144u);
  EXPECT_TRUE(
      std::equal(one->head.position_m.begin(), one->head.position_m.end(), all->head.position_m.begin()))
      << "where they were";
  EXPECT_LE(deepest_m(*all), kMostSwallowedM);
  scene.head.more_mesh_paths = {"no/such/eyes.obj"};
  EXPECT_NE(load_scene_content(scene).error().to_string().find("eyes.obj"), std::string::npos);
}

TEST(SceneContent, AHeadsMeshMayBeInTheCentimetresOfItsHair) {
  const TemporaryFolder folder;
  const Mesh head = make_head(10.0f);
  const glm::vec3 over_feet(0.0f, 160.0f, 0.0f);
  std::string mesh, points;
  size_t strands = 0;
  for (const glm::vec3& at : head.position_m) {
    const glm::vec3 p = at + over_feet;
    mesh += fmt::format("v {} {} {}\n", p.x, p.y, p.z);
    if (at.y < 2.0f) continue;
    ++strands;
    const glm::vec3 tip = 1.5f * at + over_feet;
    points += fmt::format("{} {} {}\n{} {} {}\n", p.x, p.y, p.z, tip.x, tip.y, tip.z);
  }
  for (const glm::uvec3& t : head.triangle) mesh += fmt::format("f {} {} {}\n", t.x + 1, t.y + 1, t.z + 1);
  SceneDesc scene = built_in_scene();
  FileGroomDesc file;
  file.path = folder.write(
      "hair.ply", fmt::format("ply\nformat ascii 1.0\ncomment strand_vertex_count 2\nelement vertex "
                              "{}\nproperty float x\nproperty float y\nproperty float z\nend_header\n",
                              2 * strands) +
                      points);
  scene.groom = file;
  scene.head.mesh_path = folder.write("head.obj", mesh);
  const auto content = load_scene_content(scene);
  ASSERT_TRUE(content) << content.error().to_string();
  EXPECT_EQ(content->groom.file_unit_m, 0.01f);
  EXPECT_EQ(content->unlikely, "");
  ASSERT_EQ(content->head.position_m.size(), head.position_m.size());
  const HeadMeasure measure = measure_head(content->head, spheres_of(*content), content->groom);
  EXPECT_LT(measure.root_most_m, 1e-4);
}

TEST(SceneContent, WhatWasGuessedIsSaid) {
  const std::filesystem::path path =
      std::filesystem::path(STRANDCAST_SHARED_DATA) / "grooms/ponytail_side.tfx";
  REQUIRE_SHARED(path);
  SceneDesc scene = built_in_scene();
  FileGroomDesc file;
  file.path = path;
  scene.groom = file;
  scene.head.radius_m = 0.0f;
  const auto guessed = load_scene_content(scene);
  ASSERT_TRUE(guessed) << guessed.error().to_string();
  ASSERT_GE(guessed->notes.size(), 3u);
  EXPECT_EQ(guessed->notes[0],
            "+Y of the file is up: the hair speaks for no other side (groom.file.up_axis states it)");
  EXPECT_EQ(guessed->notes[1],
            "turned by 180 degrees to face +Z: the hairline is highest at -Z (groom.file.yaw_deg states it)");
  EXPECT_EQ(guessed->notes[2].find("1 unit = 3.3"), 0u) << guessed->notes[2];
  // Stated, it is done and not said.
  file.yaw_deg = 180.0f;
  file.has_yaw = true;
  file.has_up_axis = true;
  file.unit_m = guessed->groom.file_unit_m;
  scene.groom = file;
  const auto stated = load_scene_content(scene);
  ASSERT_TRUE(stated);
  EXPECT_EQ(stated->notes.size(), guessed->notes.size() - 3);
  EXPECT_EQ(stated->groom.rest_position_m, guessed->groom.rest_position_m);
}

/// Strands of two vertices out of a ball about the origin, which is `longer` along +Z, as a .hair file.
/// Roots go down to `lowest` radii; -1: all around.
test::ByteFile hair_on_a_ball(float radius_m, float longer = 1.0f, float lowest = -1.0f) {
  constexpr uint32_t kStrands = 40, kPoints = 2;
  test::ByteFile file;
  for (const char c : {'H', 'A', 'I', 'R'}) file.add(c);
  file.add(kStrands).add(kPoints * kStrands).add(kPoints).add(kPoints - 1);
  file.add(0.1f).add(0.0f).add(0.5f).add(0.4f).add(0.3f).zeros(88);
  for (uint32_t s = 0; s < kStrands; ++s) {
    const float height = lowest + (1.0f - lowest) * (static_cast<float>(s) + 0.5f) / kStrands;
    const float level = std::sqrt(1.0f - height * height);
    const float angle = 2.4f * static_cast<float>(s);
    for (const float away_m : {radius_m, radius_m + 0.1f})
      file.add(away_m * level * std::cos(angle))
          .add(away_m * level * std::sin(angle))
          .add(longer * away_m * height);
  }
  return file;
}

// In a file with +Z up everything is turned alike: what pointed out of the mesh still does.
TEST(SceneContent, AMeshIsTurnedWithItsNormals) {
  const TemporaryFolder folder;
  SceneDesc scene = built_in_scene();
  FileGroomDesc file;
  file.path = folder.write("ball.hair", hair_on_a_ball(0.1f).text());
  file.unit_m = 1.0f;
  file.up_axis = UpAxis::Z;
  file.has_up_axis = true;
  file.has_origin = true;
  scene.groom = file;
  scene.head.mesh_path = folder.write("head.obj",
                                      "v 0 0 0.1\nv 0.1 0 0\nv 0 0.1 0\n"
                                      "vn 0 0 1\nvn 1 0 0\nvn 0 1 0\nf 1//1 2//2 3//3\n");
  const auto content = load_scene_content(scene);
  ASSERT_TRUE(content.ok()) << content.error().to_string();
  ASSERT_EQ(content->head.normal.size(), 3u);
  for (size_t i = 0; i < 3; ++i)
    EXPECT_GT(glm::dot(glm::normalize(content->head.position_m[i]), content->head.normal[i]), 0.99f);
  EXPECT_GT(content->head.position_m[0].y, 0.05f) << "what was +Z is up";
}

TEST(SceneContent, FurGetsNoHeadUnlessOneIsStated) {
  using testing::Contains;
  using testing::HasSubstr;
  const TemporaryFolder folder;
  SceneDesc scene = built_in_scene();
  scene.head.radius_m = 0.0f;
  FileGroomDesc file;
  file.unit_m = 1.0f;
  struct Case {
    float longer, lowest;
    bool has_head;
  };
  for (const auto& [longer, lowest, has_head] :
       {Case{1.0f, -0.2f, true}, Case{1.0f, -1.0f, false}, Case{4.0f, -1.0f, false}}) {
    file.path = folder.write("ball.hair", hair_on_a_ball(0.1f, longer, lowest).text());
    scene.groom = file;
    const auto content = load_scene_content(scene);
    ASSERT_TRUE(content) << content.error().to_string();
    EXPECT_EQ(!content->head.triangle.empty(), has_head) << longer << " " << lowest;
    EXPECT_EQ(!content->colliders.empty(), has_head) << longer;
    const auto says_so = Contains(HasSubstr("no head is put under it"));
    if (has_head) {
      EXPECT_THAT(content->notes, testing::Not(says_so));
    } else {
      EXPECT_THAT(content->notes, says_so);
    }
  }
  scene.head.has_center = true;
  const auto stated = load_scene_content(scene);
  ASSERT_TRUE(stated) << stated.error().to_string();
  EXPECT_FALSE(stated->head.triangle.empty());
  EXPECT_FALSE(stated->colliders.empty());
}

TEST(SceneContent, ARodTakesWhatItsFileSaysAndTheSceneGoesBefore) {
  SceneDesc scene = built_in_scene();
  scene.solver = {"direct_rod", {{"density_kgpm3", 1100.0}}};
  const HairMaterial material{8e-5, 2e9, 1250.0, {}};
  const std::map<std::string, double> expected = {
      {"radius_m", 4e-5}, {"young_modulus_pa", 2e9}, {"density_kgpm3", 1100.0}};
  EXPECT_EQ(with_material(scene, material).solver.parameters, expected);
  EXPECT_EQ(with_material(scene, {}).solver.parameters, scene.solver.parameters);
  scene.solver = {"dftl", {}};
  EXPECT_TRUE(with_material(scene, material).solver.parameters.empty());
}

TEST(SceneContent, MissingFilesAreNamed) {
  SceneDesc scene = built_in_scene();
  FileGroomDesc file;
  file.path = "no/such/groom.tfx";
  scene.groom = file;
  auto content = load_scene_content(scene);
  ASSERT_FALSE(content.ok());
  EXPECT_NE(content.error().to_string().find("groom.tfx"), std::string::npos);

  scene = built_in_scene();
  scene.head.mesh_path = "no/such/head.obj";
  content = load_scene_content(scene);
  ASSERT_FALSE(content.ok());
  EXPECT_NE(content.error().to_string().find("head.obj"), std::string::npos);
}

}  // namespace
}  // namespace strandcast::scene_content_test
